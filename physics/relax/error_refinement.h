#pragma once
/// Shorter segments where the tip's error comes from, and nowhere else.

#include "physics/relax/discretisation_error.h"
#include "physics/relax/global_relaxer.h"

namespace physics {

struct ErrorRefinementOptions {
    double tolerance = 0.01;        // of the tip, by the estimate [mm]
    int most_rounds = 12;           // of splits, each followed by a rest
    double least_piece = 1.0 / 16;  // of λ: none is split into shorter ones
};

struct ErrorRefinement {
    std::optional<double> tip;  // the last estimate [mm]
    int rounds = 0, split = 0;  // joints put in
    long long updates = 0;      // of the rests, and of the estimates two passes over the finer chain
    bool at_rest = true;
};

/// Quarters the segments that cause most of the error, as DiscretisationError::segments has it, brings the
/// chain to rest and estimates again, until the tip is within the tolerance. The chain is at rest, of this
/// relaxer; it stays so, with more segments, unless a rest fails.
ErrorRefinement refine_to_error(Chain&, const LumenWall&, GlobalRelaxer&, const ErrorRefinementOptions& = {});

}  // namespace physics
