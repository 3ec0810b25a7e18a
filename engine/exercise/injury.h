#pragma once
/// Where the end of a device breaks the wall. Only the thresholds are rules: the forces come out of the
/// equilibrium. Sources, arithmetic and range of the thresholds stand in docs/injury.md.

#include <array>
#include <span>
#include <string>
#include <vector>

#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "physics/geometry/state.h"
#include "physics/wall/wall.h"

namespace exercise {

class Simulation;

/// What a device's end does to the wall.
struct EndOnWall {
    double force = 0;   // of its joint, perpendicular to the wall that the end points at; 0 elsewhere [N]
    double end_on = 0;  // the wall's answer along the device: what its end is pushed with [N]
    double facing = 0;  // cosine between the device and the wall's normal where end_on is not 0 [-]
};
/// The device whose end leads: the outermost where the chain of them ends.
const scenario::PlacedDevice& foremost(const Simulation&);
/// Of a device that need not be the outermost one there. 0 for one that is not inside.
EndOnWall end_on_wall(const Simulation&, script::DeviceRole);

enum class InjuryKind {
    Dissection,  // the layers of the wall part under the end
    Perforation  // the end goes through the wall
};
inline constexpr std::size_t injury_kinds = 2;

/// End-on forces above which the wall gives way [N].
struct WallStrength {
    std::array<double, injury_kinds> force;
    double of(InjuryKind kind) const { return force[static_cast<std::size_t>(kind)]; }
};
/// Of a wall under an end of that diameter, in a vessel of that radius [mm]: the strength of the wall times
/// the cylinder that the end would punch out of it, π · diameter · thickness / facing, for an oblique end has
/// a longer way through the wall; where the scenario says the force itself, that. `facing` above 0.
WallStrength wall_strength(const scenario::InjurySpec&, double diameter, double radius, double facing = 1);

struct Injury {
    InjuryKind kind = InjuryKind::Dissection;
    script::DeviceRole device = script::DeviceRole::Wire;
    int frame = 0;                                    // of the attempt
    geometry::Vec3 place = geometry::Vec3::Zero();    // in vessels that nothing moves [mm]
    geometry::Vec3 outward = geometry::Vec3::Zero();  // unit, out of the vessel
    int branch = 0;                                   // of the anatomy, nearest
    double along = 0;      // from the branch's start along its centreline, and past its end [mm]
    double force = 0;      // end-on: the largest since [N]
    double threshold = 0;  // which it had passed [N]
    double diameter = 0;   // of the end [mm]
    bool stated = false;   // by the scenario as a force, else derived

    void state(geometry::StateStream& s) {
        s(kind, device, frame, place, outward, branch, along, force, threshold, diameter, stated);
    }
};

/// Of a threshold: which key of the scenario, or which document, it comes from.
std::string source_of(const Injury&);
/// "The wire has perforated RRA 12 mm from its origin: it pressed with 1.53 N, the wall bears 1.40 N".
std::string sentence(const Injury&, const Simulation&);

/// The injuries of an attempt. One is raised at the first rest at which the foremost end of the devices
/// presses with more than the wall bears, and is the same one as long as the end is not away from where it
/// last did so by more than the vessel's diameter, or 5 mm in a narrow one. Where a dissected wall is pressed
/// on until it gives way that is another one, a perforation; a perforated place is not dissected besides. An
/// end from which another device leads on is not foremost: it presses on what that one guides it along.
class Injuries {
public:
    /// To be called once for each rest that is shown. The number of injuries that are new.
    int look(const Simulation&);
    std::span<const Injury> all() const { return all_; }
    /// The one whose place the end has not left; null without.
    const Injury* open() const { return open_ ? &all_.back() : nullptr; }
    int count(InjuryKind) const;
    void clear() { *this = Injuries(); }
    void state(geometry::StateStream& s) {
        s.unless_empty(all_);
        if (!all_.empty())
            s(open_, pressed_at_);
        else if (open_)  // is restored; others may read the same state meanwhile, where there was none
            open_ = false;
    }

private:
    std::vector<Injury> all_;
    bool open_ = false;                                   // the last of them
    geometry::Vec3 pressed_at_ = geometry::Vec3::Zero();  // where it was last pressed on so hard [mm]
};

}  // namespace exercise
