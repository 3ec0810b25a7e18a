#include "engine/scenario/model_choice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/lumen_wall.h"
#include "physics/wall/distance_field.h"

namespace scenario {
namespace {

using geometry::Vec3;

constexpr double shortest = 0.2, longest = 5;  // λ [mm]

void choose_segment_length(const Device& wire, double tolerance, ModelChoice& choice) {
    const LumenDemand& demand = choice.demand;
    const auto limit = [&](double length, std::string reason) {
        if (length >= choice.segment_length) return;
        choice.segment_length = length;
        choice.segment_reason = std::move(reason);
    };
    const auto bend = [&](double curvature, const std::string& what) {
        if (curvature <= 0) return;
        limit(std::sqrt(8 * tolerance / curvature),
              fmt::format("{} bends with a radius of {:.3g} mm, from which longer segments sag by more than "
                          "{:g} mm",
                          what, 1 / curvature, tolerance));
    };
    choice.segment_length = longest;
    choice.segment_reason = fmt::format("nothing asks for segments shorter than {:g} mm", longest);
    bend(demand.largest_curvature, fmt::format("'{}'", demand.sharpest));
    bend(largest_curvature(wire), "the wire's tip");
    limit(demand.smallest_radius,
          fmt::format("'{}' narrows to a radius of {:.3g} mm, and a segment is no longer than that",
                      demand.narrowest, demand.smallest_radius));
    double& length = choice.segment_length;
    length = std::max(shortest, std::floor(length / 0.05 * (1 + 1e-9)) * 0.05);
    if (const double shaped = physics::shaped_length(wire); shaped > 0)
        length = shaped / std::ceil(shaped / length * (1 - 1e-9));
}

/// The wall is all vessels', whatever a device can reach.
void choose_wall(const anatomy::Anatomy& anatomy, const LumenDemand& all, double thickest, bool closed_form,
                 ModelChoice& choice) {
    if (closed_form) {
        choice.wall = WallModel::Analytic;
        choice.wall_reason = "a tube of constant radius has a closed form";
        return;
    }
    choice.wall_reason = anatomy::obstacle_to_field(anatomy, thickest);
    if (!choice.wall_reason.empty()) return;
    physics::DistanceFieldOptions field;
    field.inner = physics::DistanceField::depth_for(thickest);
    const auto [spacing, bytes, bytes_while] = physics::DistanceField::estimate(anatomy.branches, field);
    choice.wall = WallModel::DistanceField;
    choice.wall_reason = fmt::format(
        "a grid of {:.2g} mm resolves the narrowest radius of {:.3g} mm ('{}') in about {:.0f} MB", spacing,
        all.smallest_radius, all.narrowest, std::ceil(bytes / 1e6));
}

/// With which a shaft that is straight without load leans on a bend that forces a curvature on it where it
/// begins and where it ends: EIκ over the length on which the clearance lets it straighten, twice [N].
double lean(double rigidity, double curvature, double clearance) {
    if (curvature <= 0) return 0;
    return 2 * rigidity * curvature / std::sqrt(8 * std::max(clearance, 0.1) / curvature);
}

/// How far the distal end lies from the axis of the shaft, unloaded [mm].
double arm_of(const Device& device) {
    Vec3 place = Vec3::Zero();
    geometry::Mat3 turned = geometry::Mat3::Identity();
    for (auto arc = device.shape.rbegin(); arc != device.shape.rend(); ++arc) {
        const Vec3 aside(std::cos(arc->plane), std::sin(arc->plane), 0);
        const double bent =
            std::abs(arc->angle) < 1e-9 ? 0 : arc->length * (1 - std::cos(arc->angle)) / arc->angle;
        const double on =
            std::abs(arc->angle) < 1e-9 ? arc->length : arc->length * std::sin(arc->angle) / arc->angle;
        place += turned * (on * Vec3::UnitZ() + bent * aside);
        turned = turned * Eigen::AngleAxisd(arc->angle, Vec3::UnitZ().cross(aside)).toRotationMatrix();
    }
    return place.head<2>().norm();
}

double turn_of_shape(const Device& device) {
    double turn = 0;
    for (const physics::RestArc& arc : device.shape) turn += std::abs(arc.angle);
    return turn;
}

}  // namespace

TorsionNeed torsion_need(const Device& device, const ShaftState& at, const LumenDemand& within) {
    TorsionNeed need;
    need.within = within;
    need.shaft = at.inserted + at.outside;
    need.arm = std::min(arm_of(device), within.largest_radius);
    const double turn = turn_of_shape(device);
    if (!device.twists() || turn == 0) return need;
    const double shaped = physics::shaped_length(device);
    const double give = physics::torsional_give(device, shaped, std::max(shaped, need.shaft));
    // A shape of curvature κ0 in a bend of κ: dU/dψ = EI κ0 κ per length at most.
    const double by_bend = physics::rigidity_at(device, 0) * turn * within.forced_curvature;
    need.winds_up = std::max(by_bend, std::abs(at.torque)) * give;
    if (device.holding_friction() == 0) return need;
    const double radius = 0.5 * device.outer_diameter;
    const double press = lean(physics::rigidity_at(device, reach_ahead), within.forced_curvature,
                              within.bends_radius - radius);
    need.held_back = at.held_back + device.friction * radius * press * give;
    return need;
}

double TorsionNeed::left_out(physics::Torsion model) const {
    return (model == physics::Torsion::Rigid ? winds_up : 0) +
           (model == physics::Torsion::Segments ? 0 : held_back);
}

double TorsionNeed::at_tip(double angle) const {
    return 2 * arm * std::sin(0.5 * std::min(angle, std::numbers::pi));
}

physics::Torsion least_torsion(const TorsionNeed& need, const ShaftState& at) {
    using physics::Torsion;
    const auto shows = [&](double angle, Torsion model) {
        const double least = at.now >= model ? 0.5 : 1;
        return angle > least * torsion_shows && need.at_tip(angle) > least * torsion_shows_at_tip;
    };
    if (shows(need.held_back, Torsion::Segments)) return Torsion::Segments;
    if (shows(need.winds_up, Torsion::Whole) || std::abs(at.wound_up) > 0.5 * torsion_shows)
        return Torsion::Whole;
    return Torsion::Rigid;
}

std::string torsion_sentence(const TorsionNeed& need, physics::Torsion model) {
    using physics::Torsion;
    const std::string how = model == Torsion::Rigid   ? "turns with its hub at once"
                            : model == Torsion::Whole ? "winds up as a whole"
                                                      : "twists segment by segment";
    if (need.arm == 0) return how + ": its tip is straight, so that no turn of it shows";
    const std::string bend =
        need.within.bends.empty() ? "no bend" : fmt::format("the bend of '{}'", need.within.bends);
    std::string said = fmt::format(
        "{}: within reach {} can wind up {:.0f} mm of it by {:.2g} degrees, and friction hold it back by "
        "{:.2g}",
        how, bend, need.shaft, need.winds_up / geometry::degree, need.held_back / geometry::degree);
    const double left = need.left_out(model);
    if (left > 0)
        said += fmt::format("; up to {:.2g} degrees are left out, {:.2g} mm at its tip",
                            left / geometry::degree, need.at_tip(left));
    return said;
}

ModelChoice choose_model(const anatomy::Anatomy& anatomy, const Reach& reach, const LumenDemand& within,
                         const Device& wire, double curve_tolerance, bool closed_form, double thickest) {
    ModelChoice choice;
    choice.demand = within;
    choose_segment_length(wire, curve_tolerance, choice);
    choose_wall(anatomy, reach.all(), std::max(thickest, 0.5 * wire.outer_diameter), closed_form, choice);
    return choice;
}

ModelChoice choose_model(const anatomy::Anatomy& anatomy, const Device& wire, double curve_tolerance,
                         bool closed_form, double thickest) {
    const Reach reach(anatomy);
    return choose_model(anatomy, reach, reach.all(), wire, curve_tolerance, closed_form, thickest);
}

}  // namespace scenario
