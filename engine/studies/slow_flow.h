#pragma once
/// Where a wire comes to rest when it moves so slowly that it cannot pass a barrier: the reference that the
/// studies compare every method with.
///
/// Each step minimises the energy plus a drag ½ μ λ Σ|δx_j|² on the joints to second order (implicit descent
/// in a viscous medium). μ is raised until the model is convex, no joint moves farther than `stride` and the
/// true energy falls; it is lowered while these hold, so that the last steps are Newton's.

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace studies {

struct SlowFlow {
    double stride = 0.02;     // largest motion of a joint in a step [mm]
    double tolerance = 1e-9;  // |g|/C at rest [-]
    int most_steps = 20'000;
};

struct SlowFlowReport {
    int steps = 0;
    double energy = 0;     // [N·mm]
    double gradient = 0;   // |g|/C at the end [-]
    bool at_rest = false;  // the gradient is within the tolerance, or no step lowers the energy any more
};

SlowFlowReport flow_to_rest(physics::Chain&, const physics::LumenWall&, const SlowFlow& = {});

}  // namespace studies
