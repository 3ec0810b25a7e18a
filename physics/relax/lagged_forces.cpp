#include "physics/relax/lagged_forces.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "physics/wire/energy.h"

namespace physics {
namespace {

/// The largest force that a joint's grip resists.
double grip_force(const Chain& chain, std::span<const WallContact> contacts, const LumenWall& wall,
                  std::size_t joint) {
    assert(joint < contacts.size() && chain.friction[joint] >= 0);
    const double mu = chain.grips[joint].rests() ? chain.static_friction[joint] : chain.friction[joint];
    const double radius = chain.inner_radius() + chain.thickness[joint];
    return mu * contacts[joint].force() +
           chain.length_of(static_cast<int>(joint)) * wall.holds(chain.joints[joint], radius, mu);
}

constexpr double most_change = 1e9;  // of forces that have all gone, as a multiple of what is tolerated

}  // namespace

bool LaggedForces::next_round() {
    if (rounds_ >= options_.most_rounds) return false;
    if (rounds_++ == 0) changes_ = {};
    assert(rounds_ <= options_.most_rounds);
    return true;
}

bool LaggedForces::stalls(double change) const {
    assert(rounds_ <= options_.most_rounds && !(change < 0));
    return rounds_ > options_.least_rounds && change > options_.stalled_fraction * changes_[1];
}

bool LaggedForces::update(Chain& chain, std::span<const WallContact> contacts, const LumenWall& wall,
                          const Foundation* foundation) {
    assert(chain.grips.size() == chain.joints.size() && contacts.size() == chain.joints.size());
    double largest = 0, change = 0;  // as a multiple of what is tolerated
    for (std::size_t j = 1; j < chain.grips.size(); ++j) {
        const double force = grip_force(chain, contacts, wall, j);
        largest = std::max(largest, force);
        change = std::max(change, std::abs(force - chain.grips[j].force));
    }
    if (change > 0) change = largest > 0 ? change / (options_.tolerance * largest) : most_change;
    if (foundation) change = std::max(change, yields_.measure(chain, contacts, *foundation));
    if (change <= 1 || stalls(change)) return false;
    // Forces that jump back and forth meet half way.
    const double part = changes_[0] > 0 && change > options_.halved_fraction * changes_[0] ? 0.5 : 1;
    changes_ = {change, changes_[0]};
    if (foundation) yields_.take(chain, part);
    const bool rolls = std::any_of(chain.devices.begin(), chain.devices.end(),
                                   [](const Device& device) { return device.twists_by_segments(); });
    const double stored = grip_energy(chain.grips, chain.joints, 1);
    for (std::size_t j = 1; j < chain.grips.size(); ++j) {
        Grip& grip = chain.grips[j];
        const double force = grip_force(chain, contacts, wall, j);
        // A contact that is gone has no normal; what holds a joint without a contact does so all around.
        if (force > 0) grip.normal = contacts[j].touches() ? contacts[j].normal.normalized() : Vec3::Zero();
        grip.force += part * (force - grip.force);
        if (part == 1) grip.force = force;
        if (rolls && grip.holds())
            grip.around = (chain.inner_radius() + chain.thickness[j]) * chain.tangents[j].cross(grip.normal);
    }
    chain.friction_loss += stored - grip_energy(chain.grips, chain.joints, 1);
    assert(std::isfinite(chain.friction_loss));
    return true;
}

bool LaggedForces::let_go(Chain& chain, std::span<const WallContact> contacts) {
    if (!chain.sticks()) return false;
    std::vector<std::size_t> slipped;
    for (std::size_t j = 1; j < chain.grips.size(); ++j) {
        const Grip& grip = chain.grips[j];
        if (grip.holds() && grip.rests() && chain.static_friction[j] > chain.friction[j] &&
            grip.stretch(chain.joints[j]).norm() > slip_length * (1 + 1e-9))
            slipped.push_back(j);
    }
    if (slipped.empty()) return false;
    if (!snaps_) ledger_ = total_energy(chain, contacts).total() + chain.friction_loss;
    snaps_ = true;
    for (const std::size_t j : slipped) {
        chain.grips[j].rested = just_slipped;
        chain.grips[j].force *= chain.friction[j] / chain.static_friction[j];
    }
    // The forces are sought anew from here.
    changes_ = {};
    rounds_ = 0;
    assert(std::isfinite(ledger_));
    return true;
}

void LaggedForces::close(Chain& chain, std::span<const WallContact> contacts) {
    if (!snaps_) return;
    chain.friction_loss = ledger_ - total_energy(chain, contacts).total();
    snaps_ = false;
    assert(std::isfinite(chain.friction_loss));
}

}  // namespace physics
