#pragma once
/// Dry friction of a device in the lumen of the device around it, and in the valve through which it enters.
/// Devices on one centreline are fed and turned at their hubs, so that both surfaces slide by each other by
/// the same way everywhere: one elastic slide, as a Grip has it at each joint, says all. It has two
/// components, along the chain and around it, and Coulomb's law bounds their vector sum.

#include <algorithm>
#include <cmath>

#include "physics/geometry/vec.h"
#include "physics/wire/grip.h"

namespace physics {

/// Takes the place of a device in Rub::outer: a valve that stands still in the room.
constexpr int in_room = -1;

/// Of one device against one around it. Ways count motions of the inner device's surface against the outer's:
/// forward along the chain, and about its axis by the turn of the hubs times the inner device's radius. Up to
/// slip_length they are elastic.
struct Rub {
    int inner = 0, outer = in_room;  // devices of the chain
    bool valve = false;              // on the hub of `outer`, or in the room; otherwise the lumen of `outer`
    Vec2 slide = Vec2::Zero();       // elastic, when it was last brought up to date [mm]
    Vec2 moved = Vec2::Zero();       // slid since [mm]
    Vec2 force = Vec2::Zero();       // on the inner device then, > 0 forward and as its hub turns [N]
    double rested = rest_time;       // since it slipped, as a Grip's [s]

    bool slips(const Vec2& further = Vec2::Zero()) const {
        return (slide + moved + further).norm() > slip_length * (1 + 1e-9);
    }
    /// Whether it holds by the static coefficient.
    bool holds_fast() const { return rested >= rest_time && !slips(); }
    /// Fraction of the largest force that acts on the inner device if it slides on by so much [-].
    Vec2 fraction(const Vec2& further = Vec2::Zero()) const {
        const Vec2 motion = slide + moved + further;
        return -motion / std::max(slip_length, motion.norm());
    }
    double energy() const { return -0.5 * force.dot(slide); }  // elastic [N·mm]

    bool operator==(const Rub&) const = default;
    void state(StateStream& s) { s(inner, outer, valve, slide, moved, force, rested); }
};

}  // namespace physics
