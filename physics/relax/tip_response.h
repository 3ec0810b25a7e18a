#pragma once
/// What a change of material does to a chain at rest while its hubs are held.

#include <optional>

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

/// How far the tip moves, to first order [mm], where a chain at rest has become `changed`: the same joints,
/// with other sections or shapes, assigned; forces of friction as they are. One step of Newton's method from
/// there by the recursion, whose factors are those of the equilibrium (docs/solver.md): the derivative is
/// exact, as the step's right-hand side is the change of the gradient. Empty where the chain is no strict
/// minimum.
std::optional<Vec3> tip_response(const LumenWall&, const Chain& changed);

}  // namespace physics
