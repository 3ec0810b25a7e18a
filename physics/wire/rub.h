#pragma once
/// Dry friction of a device along the chain's axis: in the lumen of the device around it, and in the valve
/// through which it enters. Devices on one centreline are fed by lengths, so that both surfaces slide by each
/// other by the same length everywhere: one elastic slide, as a Grip has it at each joint, says all.

#include <algorithm>
#include <cmath>

#include "physics/wire/grip.h"

namespace physics {

/// Takes the place of the device around in Rub::outer: the valve, which stands still in the room.
constexpr int valve = -1;

/// Of one device against one around it. The slide counts forward movements of the inner device against the
/// outer; up to slip_length it is elastic.
struct Rub {
    int inner = 0, outer = valve;  // devices of the chain
    double slide = 0;              // elastic, when it was last brought up to date [mm]
    double moved = 0;              // slid since [mm]
    double force = 0;              // on the inner device then, > 0 forward [N]
    double rested = rest_time;     // since it slipped, as a Grip's [s]

    bool slips() const { return std::abs(slide + moved) > slip_length * (1 + 1e-9); }
    /// Whether it holds by the static coefficient.
    bool holds_fast() const { return rested >= rest_time && !slips(); }
    /// Share of the largest force that acts on the inner device, > 0 forward, if it slides on by so much [-].
    double share(double further = 0) const {
        return -std::clamp((slide + moved + further) / slip_length, -1.0, 1.0);
    }
    double energy() const { return -0.5 * force * slide; }  // elastic [N·mm]

    bool operator==(const Rub&) const = default;
    void state(StateStream& s) { s(inner, outer, slide, moved, force, rested); }
};

}  // namespace physics
