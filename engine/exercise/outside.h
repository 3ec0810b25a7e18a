#pragma once
/// What happens between the hands and the valves: each device's shaft outside, which sags, bows and stores
/// what the hand has fed and the vessels have not taken.

#include <optional>
#include <span>
#include <vector>

#include "engine/scenario/scenario.h"
#include "physics/relax/hub.h"
#include "physics/wire/outside_shaft.h"

namespace exercise {

/// Shaft between a hand and the valve, of length `distance` [mm]: its critical load is the device's
/// buckling_force, which is stated for scenario::free_shaft, or Euler's; its weight is that of a solid of the
/// device's section, of 6.5 g/cm³ (nitinol) for a wire and of 1.5 for a catheter (an estimate: a polymer with
/// a braid).
physics::OutsideShaft outside_shaft(const scenario::Device&, double distance);

/// The shafts outside of all devices, from rest to rest of the chain.
class Outside {
public:
    /// All hands at `distance` from their valves, all shafts without load.
    void reset(std::span<const scenario::PlacedDevice>, double distance);
    /// The hand takes the shaft at another distance, with the force that it has if the shaft bears it.
    void grip(int device, const scenario::Device&, double distance);
    /// Nobody feeds the shaft any more.
    void let_go(int device) { shafts_[device].bow = 0; }

    /// Of what a hand feeds, what is to go in; the rest bows the shaft, or comes out of its bow.
    double goes_in(int device, double feed, double push) const;
    /// The hand has fed `by`, of which `in` went in; the push has changed from `before` to `now`.
    void fed(int device, double by, double in, double before, double now);
    /// A feed was refused for its push; whether the shaft takes it.
    bool takes(int device, double feed);
    /// Push that the device may have after a feed of so much by the hand, or by the bow alone [N].
    double bears(int device, double by_hand = 0) const;
    /// The largest push that it passes on, with the deepest bow [N].
    double passes_on(int device) const { return shafts_[device].push_at(shafts_[device].most_bow()); }
    /// What the bow feeds of a device at a rest with these loads, or takes back; empty where all are in
    /// balance, or enough has been tried since a hand moved.
    struct Release {
        int device = 0;
        double feed = 0;  // [mm]
    };
    std::optional<Release> release(const physics::Chain&, std::span<const physics::HubLoad>);
    /// No more is tried until a hand moves.
    void give_up() { tries_ = most_tries; }

    const physics::OutsideShaft& shaft(int device) const { return shafts_[device]; }
    void state(geometry::StateStream& s) { s(shafts_, answers_, tries_); }

private:
    static constexpr int most_tries = 12;
    std::vector<physics::OutsideShaft> shafts_;
    std::vector<double> answers_;  // of the chain: rise of the push for each mm that goes in [N/mm]
    int tries_ = 0;                // since a hand moved
};

}  // namespace exercise
