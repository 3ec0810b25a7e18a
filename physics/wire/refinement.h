#pragma once
/// No more joints than the wire's curve needs: λ fine at the tip and in bends, coarse in straight vessel.

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

/// Segments are λ·2^k long, λ that of the chain; a segment lies a whole multiple of its length from the
/// introducer and is at most twice as long as its neighbours.
struct RefinementOptions {
    /// A segment is too long where its sagitta ℓ²κ/8, κ the larger curvature at its ends, exceeds this, where
    /// it lies deeper in the wall between its ends by more than this, or where the wire comes to touch the
    /// wall along it: a touch that moves along the wall turns the free wire beyond. It bounds the change of
    /// the curve itself; the rest that follows differs more where free wire acts as a lever. After most
    /// pushes of the economy study that rest is within this of the uniform wire's, but not where the vessel
    /// leaves several rests to choose from [mm].
    double curve_tolerance = 0.05;
    int longest = 16;         // segment, a power of two [λ]
    double fine_length = 10;  // kept at λ proximal of the floppy and curved tip, where wire comes in [mm]
};

/// Everything that makes the options unusable, a sentence each; empty when they are fine.
std::vector<std::string> problems(const RefinementOptions&);

struct RefinementReport {
    int split = 0, merged = 0;  // segments
};

/// Splits segments that are too long and merges pairs that would be well within the tolerance (half of it, so
/// that a wire near the limit does not switch back and forth). Meant for a wire at rest that is relaxed
/// afterwards: the joints distal of a change move by less than the tolerance. The first segment and the
/// distal ones stay at λ. A second call changes nothing. Lengths must be as above (asserted).
RefinementReport refine(Chain&, const LumenWall&, const RefinementOptions& = {});

}  // namespace physics
