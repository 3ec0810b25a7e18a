#include "physics/relax/lagged_yields.h"

#include <algorithm>
#include <cassert>

#include "physics/wire/energy.h"

namespace physics {
namespace {

/// A joint's own give is at most so many times that of a row of equal forces: of one that bears little beside
/// others that bear much.
constexpr double softer = 3;

double most_give(const Foundation& foundation, const Chain& chain, int joint, int station) {
    return foundation.give_of_many(station, chain.length_of(joint));
}

double least_give(const Foundation& foundation, const Chain& chain, int joint, int station) {
    return std::min(foundation.give(station), most_give(foundation, chain, joint, station));
}

}  // namespace

void LaggedYields::prepare(Chain& chain, const Foundation& foundation) {
    assert(chain.grips.empty() || chain.grips.size() == chain.joints.size());
    for (std::size_t j = 1; j < chain.grips.size(); ++j)
        if (Grip& grip = chain.grips[j]; grip.give == 0) {
            grip.give = least_give(foundation, chain, static_cast<int>(j), chain.stations[j]);
            grip.along = foundation.along(chain.stations[j]);
        }
}

double LaggedYields::measure(const Chain& chain, std::span<const WallContact> contacts,
                             const Foundation& foundation) {
    assert(contacts.size() == chain.joints.size());
    const Foundation::Displacement displacement = foundation.displacement(vessel_loads(chain, contacts));
    gives_.assign(contacts.size(), 0.0);
    alongs_.assign(contacts.size(), Vec3::Zero());
    shifts_.assign(contacts.size(), Vec3::Zero());
    double farthest = 0, missed = 0;
    for (std::size_t j = 1; j < contacts.size(); ++j) {
        const WallContact& c = contacts[j];
        const int joint = static_cast<int>(j);
        double& give = gives_[j] = least_give(foundation, chain, joint, c.station);
        alongs_[j] = foundation.along(c.station);
        if (!c.touches() || foundation.springs_alone(c.station)) continue;
        const Vec3 push = c.on_vessel();
        const double force = push.norm();
        if (force == 0) continue;
        const Vec3 moved = foundation.at(displacement, c.station, chain.joints[j] - c.given);
        give = std::clamp(moved.dot(push) / (force * force), give,
                          softer * most_give(foundation, chain, joint, c.station));
        // What is left of it against the joint's own force: of vessels that others push back.
        if (const double left = moved.dot(push) / force - give * force; left < 0)
            shifts_[j] = left / force * push;
        farthest = std::max(farthest, give * force);
        const double turned = (alongs_[j] - chain.grips[j].along).norm();
        missed =
            std::max(missed, std::abs(give - chain.grips[j].give) * force + turned * turned * give * force +
                                 (shifts_[j] - chain.grips[j].shift).norm());
    }
    return missed / (options_.yield_tolerance * farthest + options_.least_yield);
}

void LaggedYields::take(Chain& chain, double part) const {
    assert(gives_.size() == chain.grips.size());
    for (std::size_t j = 1; j < gives_.size(); ++j) {
        Grip& grip = chain.grips[j];
        grip.give += part * (gives_[j] - grip.give);
        grip.along = alongs_[j];
        grip.shift += part * (shifts_[j] - grip.shift);
    }
}

}  // namespace physics
