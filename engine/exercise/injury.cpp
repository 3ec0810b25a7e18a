#include "engine/exercise/injury.h"

#include <algorithm>
#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/organs.h"
#include "engine/exercise/simulation.h"
#include "physics/wall/past_end.h"

namespace exercise {
namespace {

using geometry::Vec3;

constexpr double faces_wall = 0.26;  // cosine to the wall's normal from which an end points at it: 15° [-]

/// Two wounds as near to each other as this are one, if the vessel is not wider: a fast hand feeds as much in
/// two frames [mm].
constexpr double one_place = 5;

/// The vessel at a place where a joint has that contact. Past an end it narrows.
struct Vessel {
    double radius = 0;  // 0 in a sheath, which is no vessel [mm]
    double past = 0;    // way past the end that the place lies behind [mm]
};
Vessel vessel_at(const Simulation& simulation, const Vec3& place, const physics::WallContact& contact) {
    Vessel vessel{contact.clearance + simulation.wire().inner_radius() + contact.thickness, 0};
    const bool past_end = simulation.readings().motion.past_vessel_end;
    for (const anatomy::VesselEnd& end : simulation.anatomy().ends) {
        const geometry::OpenEnd& opening = end.opening;
        if (!past_end && opening.goes_on != geometry::Continuation::Sheath) continue;
        const double radius = physics::radius_past(opening, place);
        if (!(radius <= vessel.radius)) continue;
        vessel = {radius, std::max(0.0, (place - opening.centre).dot(opening.outward_normal))};
    }
    return vessel;
}

}  // namespace

const scenario::PlacedDevice& foremost(const Simulation& simulation) {
    const physics::Chain& wire = simulation.wire();
    return simulation.devices()[static_cast<std::size_t>(wire.outermost(wire.inserted_length()))];
}

EndOnWall end_on_wall(const Simulation& simulation, script::DeviceRole device) {
    const std::size_t joint = simulation.path_of(device).size();
    if (joint < 2 || joint > simulation.contacts().size()) return {};
    const physics::WallContact& contact = simulation.contacts()[joint - 1];
    const Vec3 along = simulation.tip_of(device).along;
    if (!contact.touches()) return {};
    // In the core of a narrowing end the normal is shorter than 1: what the walls around answer.
    const double slope = along.dot(contact.normal);
    if (slope <= 0) return {};
    return {slope > faces_wall ? contact.force() : 0, contact.force() * slope, slope / contact.normal.norm()};
}

WallStrength wall_strength(const scenario::InjurySpec& spec, double diameter, double radius, double facing) {
    const double cylinder = std::numbers::pi * diameter * spec.wall_over_radius * radius / facing;  // [mm²]
    return {{spec.dissection_force.value_or(spec.dissection * cylinder),
             spec.perforation_force.value_or(spec.perforation * cylinder)}};
}

std::string source_of(const Injury& injury) {
    if (injury.stated)
        return injury.kind == InjuryKind::Perforation ? "[injury] perforation_N" : "[injury] dissection_N";
    return "derived from wall strength: docs/injury.md";
}

std::string sentence(const Injury& injury, const Simulation& simulation) {
    return fmt::format(
        "The {} has {} the {} {:.0f} mm from its origin: it pressed with {:.3g} N, the wall bears {:.3g} N",
        script::name_of(injury.device), injury.kind == InjuryKind::Perforation ? "perforated" : "dissected",
        anatomy::clinical_name(simulation.anatomy().branches[static_cast<std::size_t>(injury.branch)].name),
        injury.along, injury.force, injury.threshold);
}

int Injuries::count(InjuryKind kind) const {
    return static_cast<int>(std::ranges::count(all_, kind, &Injury::kind));
}

int Injuries::look(const Simulation& simulation) {
    const scenario::InjurySpec& spec = simulation.scenario().injury;
    const physics::Chain& wire = simulation.wire();
    const std::span<const physics::WallContact> contacts = simulation.contacts();
    if (spec.off || contacts.empty()) return 0;
    const scenario::PlacedDevice& foremost = exercise::foremost(simulation);
    const physics::WallContact& contact = contacts.back();
    const Vec3 tip = wire.joints.back(), place = tip - contact.given;
    const EndOnWall end = end_on_wall(simulation, foremost.role);
    if (end.end_on == 0 && !open_) return 0;

    const Vessel vessel = vessel_at(simulation, tip, contact);
    const double diameter = foremost.device.outer_diameter, radius = std::max(vessel.radius, 0.5 * diameter);
    if (open_ && (place - pressed_at_).norm() > std::max(2 * radius, one_place)) open_ = false;
    if (end.end_on == 0 || vessel.radius == 0) return 0;
    const WallStrength strength = wall_strength(spec, diameter, radius, end.facing);
    std::optional<InjuryKind> kind;
    for (const InjuryKind each : {InjuryKind::Dissection, InjuryKind::Perforation})
        if (end.end_on > strength.of(each)) kind = each;
    if (!kind) return 0;
    const bool same = open_ && all_.back().kind >= *kind && all_.back().device == foremost.role;
    pressed_at_ = place;
    if (same) {
        all_.back().force = std::max(all_.back().force, end.end_on);
        return 0;
    }
    open_ = true;
    const anatomy::VesselPlace nearest = anatomy::nearest_place(simulation.anatomy(), place);
    const bool stated = *kind == InjuryKind::Perforation ? spec.perforation_force.has_value()
                                                         : spec.dissection_force.has_value();
    all_.push_back({*kind, foremost.role, simulation.frames(), place, contact.normal.normalized(),
                    nearest.branch, anatomy::along(simulation.anatomy(), nearest) + vessel.past, end.end_on,
                    strength.of(*kind), diameter, stated});
    return 1;
}

}  // namespace exercise
