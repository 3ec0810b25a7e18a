#pragma once
/// Friction of devices in each other and in their valves, along the chain's axis and about it, and what a
/// rest does to all friction. The former moves no chain: each device is fed and turned by its hub. It acts on
/// the hubs, by the same force and torque on the inner device and back on the outer one: see also drag().
///
/// The turn of two surfaces against each other is taken to be that of their hubs, so that the work of these
/// torques is exact, and they wind up no shaft: left out is the twist by which friction in a lumen lets a
/// tip lag behind its hub.

#include <span>
#include <vector>

#include "physics/wire/feed.h"

namespace physics {

/// The device on whose hub the valve of this one is: the next one around it that is inside, or in_room. What
/// lies in another device enters it through the valve on that one's hub.
int carrier_of_valve(const Chain&, int device);

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

/// Adds what friction between devices and in valves takes of each hub's hand: a valve's force and torque and
/// the friction in lumens by the slides as they are, those not yet followed among them.
void add_rubs(const Chain&, std::span<const WallContact>, std::span<HubLoad>);

/// At a rest: slides follow what has slipped, as anchors do, and the energy that it has cost is counted as
/// Chain::rub_loss. Changes no force but where a device came in or went out, and another carries a valve now:
/// this begins at ease.
void follow_rubs(Chain&, std::span<const WallContact>);

/// What has not slipped since the last call has lain still by so long [s]; after rest_time it holds by the
/// static coefficient, with the force that it has. True where grips of the wall now do: the chain is still at
/// rest, but stiffer.
bool let_rest(Chain&, double seconds);

}  // namespace physics
