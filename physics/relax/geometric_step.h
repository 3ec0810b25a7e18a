#pragma once
/// One update of a few neighbouring segments that leaves the rest of the wire where it is: the geometrical
/// relaxation, for segments of any lengths.
///
/// The paper names the method of Baier et al. (2016) without its formulas. Here a piece of up to three
/// segments between two joints that stay (closed), or at the tip (open), turns to where the wire's energy is
/// least: a wall that presses elsewhere does not hinder it, and a wire slides along the curve it lies on.

#include <optional>

#include "physics/relax/segment_step.h"

namespace physics {

inline constexpr int closed_segments = 3;  // the fewest that can move in a plane

class GeometricStep {
public:
    using Tangents = std::array<Vec3, most_varied_segments>;

    /// A Newton step of the model of `problem` (1 to 3 segments), whose curvature includes the terms of
    /// neighbours; lengths λ_m [mm]. Closed: Σ λ_m v_m stays fixed, which needs all three segments.
    GeometricStep(const SegmentProblem& problem, const std::array<double, closed_segments>& lengths,
                  bool closed);

    /// The tangents after this fraction of the step, with no turn larger than `limit`; none where a closed
    /// piece cannot turn that far, as when it is stretched.
    std::optional<Tangents> turned(double fraction, double limit) const;

private:
    std::optional<Tangents> closed_by_turning(Tangents) const;

    Tangents start_, step_;  // u; ε ⟂ u
    std::array<double, closed_segments> lengths_;
    int count_;
    bool closed_;
    double largest_ = 0;  // |ε|
    bool finite_ = true;
};

}  // namespace physics
