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

/// Shaft between a hand and the valve, of length `distance` [mm], of one device or of several in each other:
/// the critical load of each is its buckling_force, which is stated for scenario::free_shaft, or Euler's; its
/// weight is that of a solid of its section, of 6.5 g/cm³ (nitinol) for a wire and of 1.5 for a catheter (an
/// estimate: a polymer with a braid). Those in each other bow alike, so that weights, rigidities and critical
/// loads add.
physics::OutsideShaft outside_shaft(std::span<const scenario::Device* const>, double distance);

/// The shafts outside of all devices, from rest to rest of the chain. A hand that moves all devices together
/// holds them at the outermost one's hub: the shaft that bows then is that one's, with the inner ones in it,
/// and its load is the sum of their pushes; the inner ones' own shafts, behind that hub, stay as they are.
/// Methods name it by the outermost device.
class Outside {
public:
    static constexpr double felt = 1e-3;  // [N]

    /// All hands at `distance` from their valves, all shafts without load.
    void reset(std::span<const scenario::PlacedDevice>, double distance);
    /// The hand takes the shaft at another distance, with the force that it has if the shaft bears it.
    void grip(int device, std::span<const scenario::PlacedDevice>, double distance);
    /// Nobody feeds the shaft any more.
    void let_go(int device) { shafts_[device].bow = 0; }
    /// Which devices are held from now on, `all` that are inside by one hand. One that nobody feeds any more
    /// straightens; what it held of an inner one that stays in hand bows that one's own shaft.
    void hold(std::span<const scenario::PlacedDevice>, const physics::Chain&, bool all);
    /// The outermost of the devices that one hand holds together; −1 = there are none.
    int outermost() const;
    bool is_within(int device) const { return (together_ >> device & 1U) != 0; }
    /// What was fed of a device that has not gone in: its bow, and that of the shaft that it is held within
    /// [mm].
    double bow(int device) const;
    /// Push on the device's shaft: that of all that are held together on their outermost's [N].
    double push(int device, std::span<const physics::HubLoad>) const;

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
        int device = 0;   // or physics::every_device
        double feed = 0;  // [mm]
    };
    std::optional<Release> release(const physics::Chain&, std::span<const physics::HubLoad>);
    /// No more is tried until a hand moves.
    void give_up() { tries_ = most_tries; }

    const physics::OutsideShaft& shaft(int device) const { return shafts_[device]; }
    void state(geometry::StateStream& s) { s(shafts_, answers_, tries_, together_); }

private:
    static constexpr int most_tries = 12;
    physics::OutsideShaft shaft_of(int device, std::span<const scenario::PlacedDevice>,
                                   double distance) const;
    void hold_together(std::span<const scenario::PlacedDevice>, unsigned devices);

    std::vector<physics::OutsideShaft> shafts_;
    std::vector<double> answers_;  // of the chain: rise of the push for each mm that goes in [N/mm]
    int tries_ = 0;                // since a hand moved
    unsigned together_ = 0;        // devices that one hand holds as one, a bit for each
};

}  // namespace exercise
