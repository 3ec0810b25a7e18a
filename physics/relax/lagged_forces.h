#pragma once
/// Friction's normal forces in rounds: a rest is sought with them held, then they become the wall's there.

#include <array>
#include <span>

#include "physics/relax/global_options.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

class LaggedForces {
public:
    explicit LaggedForces(const LagOptions& options) : options_(options) {}

    /// The next rest is that of another motion.
    void forget() { rounds_ = 0; }
    int rounds() const { return rounds_; }
    /// Begins another round; false where there are no more.
    bool next_round();
    /// The grips' forces and normals become those of the contacts of a rest, or go a part of the way. False,
    /// and nothing changes, where they agree already, or will not: forces that the wall answers by a snap
    /// back and forth have no rest of their own.
    bool update(Chain&, std::span<const WallContact>);

    void state(StateStream& s) { s(rounds_, changes_); }

private:
    bool stalls(double change) const;

    LagOptions options_;
    int rounds_ = 0;                      // so far
    std::array<double, 2> changes_ = {};  // of the last update, and of the one before it
};

}  // namespace physics
