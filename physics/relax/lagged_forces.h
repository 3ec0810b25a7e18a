#pragma once
/// What is held while a rest is sought, and then becomes what it is there, in rounds: friction's normal
/// forces, and how the vessels have made way.

#include <array>
#include <span>

#include "physics/relax/lagged_yields.h"

namespace physics {

class LaggedForces {
public:
    explicit LaggedForces(const LagOptions& options) : options_(options), yields_(options) {}

    /// The next rest is that of another motion.
    void forget() { rounds_ = 0, snaps_ = false; }
    int rounds() const { return rounds_; }
    /// Begins another round; false where there are no more.
    bool next_round();
    /// The grips' forces and normals become those of the contacts of a rest, with what else the wall holds
    /// the joints by (LumenWall::holds), and the vessels are moved by the
    /// contacts' forces, or all go a part of the way. False, and nothing changes, where they agree already,
    /// or will not: forces that the wall answers by a snap back and forth have no rest of their own.
    bool update(Chain&, std::span<const WallContact>, const LumenWall&, const Foundation* = nullptr);
    /// Of a rest whose forces agree with the wall: grips that held by the static coefficient and slip hold by
    /// the kinetic one from now on. False, and nothing changes, where none does.
    bool let_go(Chain&, std::span<const WallContact>);
    /// At the rest that is kept: what the chain has lost since grips let go, under hands that stood still,
    /// has gone into friction.
    void close(Chain&, std::span<const WallContact>);

    void state(StateStream& s) { s(rounds_, changes_, snaps_, ledger_); }

private:
    bool stalls(double change) const;

    LagOptions options_;
    int rounds_ = 0;                      // so far
    std::array<double, 2> changes_ = {};  // of the last update, and of the one before it
    bool snaps_ = false;                  // grips have let go
    double ledger_ = 0;                   // energy and friction loss when the first one did [N·mm]
    LaggedYields yields_;
};

}  // namespace physics
