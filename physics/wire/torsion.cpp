#include "physics/wire/torsion.h"

#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

namespace physics {
namespace {

double within_a_turn(double angle) {
    return std::remainder(angle, 2 * std::numbers::pi);
}

/// Calls f(joint, its place [mm]) for the joints at which the device lies on the wall.
template <class F>
void for_each_own_joint(const Chain& chain, int which, const F& f) {
    if (chain.grips.empty()) return;
    double place = 0;
    for (int j = 1; j <= chain.segments(); ++j) {
        place += chain.lengths[j];
        if (chain.outermost(place) == which) f(j, place);
    }
}

/// Grips that held the roll of a surface hold no more of it; their pushes stay.
void forget_rolls(Chain& chain, int which) {
    for_each_own_joint(chain, which, [&](int j, double) {
        Grip& grip = chain.grips[j];
        grip.anchor -= grip.roll * grip.around;
        grip.roll = 0;
        grip.around.setZero();
    });
}

/// start_twists() rolls surfaces to where a twisted shaft has them; they are held from there on.
void twist_where_it_is(Chain& chain, int which) {
    std::vector<double> rolls;
    for (const Grip& grip : chain.grips) rolls.push_back(grip.roll);
    start_twists(chain, which);
    for (std::size_t j = 0; j < rolls.size(); ++j) chain.grips[j].roll = rolls[j];
}

}  // namespace

Torsion torsion_of(const Device& device) {
    return device.twists_by_segments() ? Torsion::Segments
           : device.spec.twists()      ? Torsion::Whole
                                       : Torsion::Rigid;
}

void change_torsion(Chain& chain, int which, const DeviceSpec& spec, Torsion torsion) {
    assert(which >= 0 && which < static_cast<int>(chain.devices.size()));
    Device& device = chain.devices[which];
    if (device.twists_by_segments()) forget_rolls(chain, which);
    const double distal = device.angle_at(chain.segments());
    device.windup = device.wound_up();
    device.wound.clear();
    device.roll = within_a_turn(distal);
    device.spec = spec;
    if (torsion == Torsion::Rigid) stiffen(device.spec);
    assign(chain);
    if (torsion == Torsion::Segments) return twist_where_it_is(chain, which);
    if (device.windup_stiffness > 0) return;
    // Rigid, or with no bend on the chain that could hold it.
    device.roll = within_a_turn(device.roll + std::exchange(device.windup, 0.0));
}

double held_back(const Chain& chain, int which, const DeviceSpec& spec) {
    const Device& device = chain.devices[which];
    if (!spec.twists() || device.inserted <= 0) return 0;
    double held = 0;
    for_each_own_joint(chain, which, [&](int j, double place) {
        const Grip& grip = chain.grips[j];
        if (!grip.holds()) return;
        const double distal = std::max(0.0, device.inserted - place);
        held += grip.force * 0.5 * spec.outer_diameter *
                torsional_give(spec, distal, std::max(distal, device.inserted) + device.outside);
    });
    return held;
}

}  // namespace physics
