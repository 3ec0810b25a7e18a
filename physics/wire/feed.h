#pragma once
/// A hand at the hubs of a chain's devices: feeding, turning, and what it feels.

#include <span>

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

/// Which devices of a chain move.
constexpr int every_device = -1;

/// How feed() would change a chain by up to λ either way.
struct FeedPlan {
    int device = every_device;
    double mm = 0;             // moved: as asked for, or less on the way out [mm]
    int grows = 0;             // segment
    double change = 0;         // of its length [mm]
    double change_before = 0;  // of the length of the segment before, on the way out [mm]
    bool whole = true;  // what changes can change so: no piece of it goes, and a segment before is whole
};
/// First piece of the segment that grows, which may lie in pieces as any other: only the last one grows, and
/// the others keep their places, so that a joint that a carina holds stays with it.
int first_growing(const Chain&);

/// Less is moved where a device is out, or less than least_length() of chain would stay inside.
FeedPlan plan_feed(const Chain&, int device, double mm);
/// Moves the devices by the plan, which must be made for this chain and leave its segments a length, as one
/// that is `whole` does: the chain grows or shrinks at its growing segment, which may be too long or too
/// short until regrid(). Twist goes with the material; what comes in is not twisted, and what goes out leaves
/// its twist inside. Each grip's anchor becomes that of the material which now lies at its joint; its force
/// and normal stay. Material that was inside another device holds on where it is; what the stretch so loses
/// is added to the friction loss.
void stretch(Chain&, const FeedPlan&);
/// Splits or merges segments where the chain has grown by this plan, so that they are λ long, and the growing
/// one λ/2 to 3λ/2; follows another leading device. Pieces of it stay.
void regrid(Chain&, const FeedPlan&);

/// Moves a device along the chain, or every one: in where mm > 0. Pieces of segments that
/// go out are made whole. Returns the length moved [mm]; less at the limits of plan_feed().
double feed(Chain&, int device, double mm);

/// A hand holds the device at another distance from the introducer [mm], with the torque that it has.
void hold_at(Chain&, int device, double distance);

/// Turns a device's hub, or every one's [rad]: its material frame follows at once, or its shaft winds up.
void rotate(Chain&, int device, double angle);

/// Move every device by `mm` (negative = withdraw) in whole segments, each put in or taken out just proximal
/// of the leading device's shape (the paper, Section 2.1); the rest is carried. The chain has whole segments,
/// no friction and no twist by segments. Returns the number of segments inserted, or minus the number taken
/// out.
int move(Chain&, double mm);

/// What the hand feels at a device's hub.
struct HubLoad {
    double push = 0;    // > 0 where the hand must push [N]
    double torque = 0;  // against which the hub is held [N·mm]

    void state(StateStream& s) { s(push, torque); }
};
/// Of each device of a chain at rest, with the contacts of its joints: the derivative of the whole energy
/// (bending, twist, wall, load, friction) by what is fed and turned at the hub, all else as it is, and
/// friction of other devices and of its valve on it. At rest that is the derivative of the energy at rest, so
/// that the hands' work is the gain of energy plus the loss by friction. A chain that is bent where it leaves
/// the introducer is pressed out of it by EIκ²/2 (D. Bigoni et al., Eshelby-like forces acting on elastic
/// structures, 2015): part of it.
std::vector<HubLoad> hub_loads(const Chain&, std::span<const WallContact>);

}  // namespace physics
