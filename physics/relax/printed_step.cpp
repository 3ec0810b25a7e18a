#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/relax/segment_step.h"

namespace physics {
namespace {

constexpr int most_unknowns = 4 * most_varied_segments;

/// A·x = b with as many rows as there are unknowns in use; of a bounded size, so that no step takes memory.
struct PrintedSystem {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most_unknowns, most_unknowns> a;
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most_unknowns, 1> b;

    /// Puts the solution into b. False where the matrix is singular or a number is not finite.
    bool solve() {
        assert(a.rows() == a.cols() && a.rows() == b.size());
        const auto lu = a.partialPivLu();
        if ((lu.matrixLU().diagonal().array() == 0).any()) return false;
        b = lu.solve(b).eval();
        return b.allFinite();
    }
};

/// Eq. 33 at v and σ: δv_1 … δv_M, then δσ_1 … δσ_M, against −F of Eqs. 28 and 34.
void set_up(const SegmentProblem& p, const SegmentSolution& at, PrintedSystem& s) {
    assert(p.count >= 1 && p.count <= most_varied_segments);
    const int M = p.count;
    s.a.setZero(4 * M, 4 * M);
    s.b.resize(4 * M);
    for (int m = 0; m < M; ++m) {
        const Vec3& v = at.tangent[m];
        assert(!(std::abs(v.squaredNorm() - 1) > 1e-9) || v.isZero(0));  // zero after an overflow
        Vec3 force = at.multiplier[m] * v - p.pull[m];
        for (int n = 0; n < M; ++n) {
            force += p.curvature[m][n] * (at.tangent[n] - p.tangent[n]);
            s.a.block<3, 3>(3 * m, 3 * n) = p.curvature[m][n];
        }
        const int sigma = 3 * M + m;
        s.a.block<3, 3>(3 * m, 3 * m).diagonal().array() += at.multiplier[m];
        s.a.block<3, 1>(3 * m, sigma) = v;
        s.a.block<1, 3>(sigma, 3 * m) = v.transpose();
        s.b.segment<3>(3 * m) = -force;
        s.b[sigma] = -0.5 * (v.squaredNorm() - 1);
    }
}

}  // namespace

SegmentSolution printed_step(const SegmentProblem& p, int most_iterations) {
    assert(most_iterations >= 1);
    SegmentSolution at;
    for (int m = 0; m < p.count; ++m) {
        at.multiplier[m] = p.pull[m].norm();
        at.tangent[m] = at.multiplier[m] > 1e-300 ? Vec3(p.pull[m] / at.multiplier[m]) : p.tangent[m];
    }
    PrintedSystem system;
    while (at.iterations < most_iterations && !at.converged) {
        set_up(p, at, system);
        if (!system.solve()) break;
        SegmentSolution next = at;
        double turn = 0;
        bool finite = true;
        for (int m = 0; m < p.count; ++m) {
            const Vec3 by = system.b.segment<3>(3 * m);
            const Vec3 v = at.tangent[m] + by;
            const double length = v.norm();
            finite = finite && std::isfinite(length) && length > 0;
            next.tangent[m] = v / length;
            next.multiplier[m] += system.b[3 * p.count + m];
            turn = std::max(turn, by.lpNorm<Eigen::Infinity>());
        }
        if (!finite) break;
        at = next;
        ++at.iterations;
        at.converged = turn < 1e-14;
    }
    return at;
}

}  // namespace physics
