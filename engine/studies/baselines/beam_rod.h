#pragma once
/// Corotational Euler–Bernoulli beam elements and Newton's method (M. A. Crisfield, Non-linear finite element
/// analysis of solids and structures, 1991): each element carries a frame along its chord, in which the cubic
/// beam of small rotations is linear.
///
/// A node has its place and the direction t of the beam, five degrees of freedom: a straight, isotropic rod
/// with a free end carries no torque, so twist does not enter. With φ_a the rotation from the chord e to t_a,
///   U = EA/2L (l − L)² + 2EI/L (φ_1² + φ_1·φ_2 + φ_2²),
/// its exact gradient and tangent. The tangent is block tridiagonal, 5 × 5, and factorised without filling
/// in.

#include "engine/studies/baselines/baseline.h"

namespace baselines {

class BeamRod final : public Baseline {
public:
    using Baseline::Baseline;
    void start(const std::vector<Vec3>& nodes) override;
    /// A round is one Newton step with its line search.
    Progress advance(int rounds) override;
    double energy() const override;

    using Vec5 = Eigen::Matrix<double, 5, 1>;
    using Mat5 = Eigen::Matrix<double, 5, 5>;
    using Mat32 = Eigen::Matrix<double, 3, 2>;

private:
    void assemble();
    bool solve(double shift);
    void move(double fraction);

    std::vector<Vec3> directions_;           // t_0…t_N, unit
    std::vector<Mat32> planes_;              // bases of the planes ⟂ t
    std::vector<Vec5> gradient_, step_;      // over place and direction of node i
    std::vector<Mat5> own_, next_, factor_;  // tangent: blocks (i, i) and (i, i+1)
    double shift_ = 0;                       // added to the tangent's diagonal, where it had to be [N/mm]
};

}  // namespace baselines
