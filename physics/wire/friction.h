#pragma once
/// Friction along the chain's axis, of devices in each other and in their valves, and what a rest does to
/// all friction. The former moves no chain: each device is fed by its hub. It acts on the hubs, by the same
/// force on the inner device and back on the outer one, and drags along what no hand holds.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "physics/wire/feed.h"

namespace physics {

/// At one joint, of a device in the lumen of the one around it.
struct LumenContact {
    int inner = -1;             // the device that touches the lumen there; none beyond both devices' ends
    Vec3 press = Vec3::Zero();  // force of the outer device on it, across the chain [N]
    double friction = 0;        // on it along the chain, > 0 forward [N]
};

/// What device `outer` ≥ 1 presses on those within it, [joint], as rods: with the moment M = Σ EI (κ − κ⁰) of
/// the devices within as a vector in space, T their tension and u the tangent, they bear the force
///
///     F = T u + u × dM/ds,    and    q = −dF/ds
///
/// is what the outer device presses on them per length: in a plane |q| = |d²M/ds² − Tκ|, and along the chain
/// d(T + M·κ/2)/ds = −friction where they are straight at rest. M is that of the joints' springs, dM/ds its
/// difference along a segment; F begins where they leave the outer device, with the forces of wall, grips and
/// load on all that is distal, or with 0 where they end within it; at a joint q is integrated over its
/// length, so that the force at the outer device's end is part of it. The leading device bears the load, as
/// it is the one whose feed the load works on. Left out are the torques of twisted shafts, which press by
/// their change along a bend. Exact where the chain is at rest, as the contacts must be.
std::vector<LumenContact> lumen_contacts(const Chain&, std::span<const WallContact>, int outer);

/// At a rest: anchors of the wall's grips follow what has slipped, and the energy that it has cost is counted
/// as Chain::friction_loss. Changes no force.
void follow_grips(Chain&);

/// Begins the friction of the devices in each other and in their valves, where there is any that has not
/// begun: all at ease, and holding by the static coefficients.
void start_rubs(Chain&);

/// Adds what friction between devices and in valves takes of each hub's hand: a valve's force and the
/// friction in lumens by the slides as they are, those not yet followed among them.
void add_rubs(const Chain&, std::span<const WallContact>, std::span<HubLoad>);

/// At a rest: slides follow what has slipped, as anchors do, and the energy that it has cost is counted as
/// Chain::rub_loss. Changes no force.
void follow_rubs(Chain&, std::span<const WallContact>);

/// How far a device that no hand holds goes, at a rest with these loads, for its hub to bear no load.
struct Drag {
    int device = 0;
    double feed = 0;  // [mm]
};
/// The search for it, from rest to rest.
struct DragSearch {
    int tries = 0;  // since the last part of a hand's motion
    int device = -1;
    double feed = 0, load = 0;  // of the last try, and the chain's load before it [mm], [N]
    std::array<double, most_devices> stiffness = {};  // the chain's answers, of each device [N/mm]

    /// Begins anew, with what is known of the chain.
    void restart() { tries = 0, device = -1; }
    bool operator==(const DragSearch&) const = default;
    void state(StateStream& s) { s(tries, device, feed, load, stiffness); }
};
/// The next one to be moved: friction of what has been moved is more than its valve holds, or they balance
/// within what gives elastically. To be made and asked for again, before follow_rubs(). Empty where the
/// forces on every such device are in balance.
std::optional<Drag> drag(const Chain&, std::span<const WallContact>, std::span<const HubLoad>, DragSearch&);

/// What has not slipped since the last call has lain still by so long [s]; after rest_time it holds by the
/// static coefficient, with the force that it has. True where grips of the wall now do: the chain is still at
/// rest, but stiffer.
bool let_rest(Chain&, double seconds);

}  // namespace physics
