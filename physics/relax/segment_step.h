#pragma once
/// One update of M varied segments as a pure function (Eqs. 21–34).
///
/// Minimises  f(v) = −Σ q_m·(v_m − u_m) + ½ Σ_mn (v_m − u_m)·P_mn·(v_n − u_n)  over unit vectors v_m. The
/// paper solves a 4M×4M system for v and the multipliers (Eq. 33), as printed_step() does; the other forms
/// take the same Newton step in the planes ⟂ v_m, a 2M×2M system with the same iterates.

#include <array>

#include "physics/geometry/vec.h"

namespace physics {

using namespace geometry;

inline constexpr int most_varied_segments = 5;

struct SegmentProblem {
    int count = 0;                                   // M, 1 to 5
    std::array<Vec3, most_varied_segments> tangent;  // u_m
    std::array<Vec3, most_varied_segments> pull;     // q_m = b_m − s₍m,N₎ [N·mm]
    std::array<std::array<Mat3, most_varied_segments>, most_varied_segments>
        curvature;  // P_mn, Eq. 30 [N·mm]
};

struct SegmentSolution {
    std::array<Vec3, most_varied_segments> tangent;       // v_m
    std::array<double, most_varied_segments> multiplier;  // σ_m [N·mm]
    int iterations = 0;
    bool converged = false;  // the last Newton step was below 1e-14
};

/// f(v) [N·mm].
double model_energy(const SegmentProblem&, const std::array<Vec3, most_varied_segments>& v);

/// Newton from the first-order solution v = q̂, σ = |q| (Eq. 22). It may end in a saddle or a maximum.
SegmentSolution plain_step(const SegmentProblem&, int most_iterations = 30);

/// The same iterates as the paper prints them: Eq. 33 for all 4M unknowns, v_m and σ_m, by LU with partial
/// pivoting, every v_m made unit after each step. Where the matrix is singular or the next iterate would not
/// be finite, it ends with the iterate before, without convergence.
SegmentSolution printed_step(const SegmentProblem&, int most_iterations = 30);

/// Newton from v = u that lowers f at every iteration: the Hessian is shifted until it is positive definite,
/// and an exactly balanced start that is no minimum is kicked along a fixed tangent.
SegmentSolution descending_step(const SegmentProblem&, int most_iterations = 30);

/// One linear solve for a small turn of a single segment, as before Eq. 22: (σ + P) ε = q in the plane ⟂ u,
/// σ > 0 the stiffness of its joints [N·mm].
Vec3 small_turn_step(const SegmentProblem&, double sigma);

/// Eq. 23: the blend (1−α)u + αv, made unit; and the largest α for which |u_new − u| ≤ limit, Eq. 24.
Vec3 limited_turn(const Vec3& u, const Vec3& v, double alpha);
double largest_fraction(const Vec3& u, const Vec3& v, double limit);

}  // namespace physics
