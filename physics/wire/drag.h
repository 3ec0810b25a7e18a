#pragma once
/// What no hand holds goes and turns along with what rubs on it.

#include <array>
#include <optional>
#include <span>

#include "physics/wire/feed.h"

namespace physics {

/// How far a device that no hand holds goes and turns, at a rest with these loads, for its hub to bear no
/// load.
struct Drag {
    int device = 0;
    double feed = 0;  // [mm]
    double turn = 0;  // [rad]
};
/// The search for it, from rest to rest.
struct DragSearch {
    int tries = 0;  // since the last part of a hand's motion
    int device = -1;
    // Of the last try, and the chain's load before it: along, and about the axis at the device's radius.
    Vec2 motion = Vec2::Zero(), load = Vec2::Zero();                 // [mm], [N]
    std::array<std::array<double, 2>, most_devices> stiffness = {};  // the chain's answers [N/mm]

    /// Begins anew, with what is known of the chain.
    void restart() { tries = 0, device = -1; }
    bool operator==(const DragSearch&) const = default;
    void state(StateStream& s) { s(tries, device, motion, load, stiffness); }
};
/// The next one to be moved: friction of what has been moved is more than its valve holds, or they balance
/// within what gives elastically. To be made and asked for again, before follow_rubs(). Empty where the
/// forces on every such device are in balance.
std::optional<Drag> drag(const Chain&, std::span<const WallContact>, std::span<const HubLoad>, DragSearch&);

}  // namespace physics
