#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "physics/relax/segment_step.h"

namespace physics {
namespace {

constexpr int most_unknowns = 4 * most_varied_segments;

/// A·x = b with as many rows as there are unknowns in use, by rows.
struct PrintedSystem {
    int size = 0;
    std::array<std::array<double, most_unknowns>, most_unknowns> a;
    std::array<double, most_unknowns> b;
};

/// LU with partial pivoting, each row's pivot weighed by the row's largest number (Press et al., 1992,
/// Section 2.3); the solution replaces b. False where the matrix is singular or a number is not finite.
bool solve_by_lu(PrintedSystem& s) {
    std::array<double, most_unknowns> weight;
    for (int i = 0; i < s.size; ++i) {
        double largest = 0;
        for (int j = 0; j < s.size; ++j) largest = std::max(largest, std::abs(s.a[i][j]));
        if (!(largest > 0) || !std::isfinite(largest)) return false;
        weight[i] = 1 / largest;
    }
    for (int k = 0; k < s.size; ++k) {
        int pivot = k;
        for (int i = k + 1; i < s.size; ++i)
            if (weight[i] * std::abs(s.a[i][k]) > weight[pivot] * std::abs(s.a[pivot][k])) pivot = i;
        if (s.a[pivot][k] == 0) return false;
        if (pivot != k) {
            std::swap(s.a[pivot], s.a[k]);
            std::swap(s.b[pivot], s.b[k]);
            std::swap(weight[pivot], weight[k]);
        }
        const double inverse = 1 / s.a[k][k];
        for (int i = k + 1; i < s.size; ++i) {
            const double share = s.a[i][k] * inverse;
            for (int j = k + 1; j < s.size; ++j) s.a[i][j] -= share * s.a[k][j];
            s.b[i] -= share * s.b[k];
        }
    }
    for (int i = s.size - 1; i >= 0; --i) {
        for (int j = i + 1; j < s.size; ++j) s.b[i] -= s.a[i][j] * s.b[j];
        s.b[i] /= s.a[i][i];
        if (!std::isfinite(s.b[i])) return false;
    }
    return true;
}

/// Eq. 33 at v and σ: δv_1 … δv_M, then δσ_1 … δσ_M, against −F of Eqs. 28 and 34.
void set_up(const SegmentProblem& p, const SegmentSolution& at, PrintedSystem& s) {
    const int M = p.count;
    s.size = 4 * M;
    for (int i = 0; i < s.size; ++i) std::fill_n(s.a[i].begin(), s.size, 0.0);
    for (int m = 0; m < M; ++m) {
        const Vec3& v = at.tangent[m];
        Vec3 force = at.multiplier[m] * v - p.pull[m];
        for (int n = 0; n < M; ++n) {
            force += p.curvature[m][n] * (at.tangent[n] - p.tangent[n]);
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) s.a[3 * m + r][3 * n + c] = p.curvature[m][n](r, c);
        }
        const int sigma = 3 * M + m;
        for (int r = 0; r < 3; ++r) {
            s.a[3 * m + r][3 * m + r] += at.multiplier[m];
            s.a[3 * m + r][sigma] = s.a[sigma][3 * m + r] = v[r];
            s.b[3 * m + r] = -force[r];
        }
        s.b[sigma] = -0.5 * (v.squaredNorm() - 1);
    }
}

}  // namespace

SegmentSolution printed_step(const SegmentProblem& p, int most_iterations) {
    SegmentSolution at;
    for (int m = 0; m < p.count; ++m) {
        at.multiplier[m] = p.pull[m].norm();
        at.tangent[m] = at.multiplier[m] > 1e-300 ? Vec3(p.pull[m] / at.multiplier[m]) : p.tangent[m];
    }
    PrintedSystem system;
    while (at.iterations < most_iterations && !at.converged) {
        set_up(p, at, system);
        if (!solve_by_lu(system)) break;
        SegmentSolution next = at;
        double turn = 0;
        bool finite = true;
        for (int m = 0; m < p.count; ++m) {
            const Vec3 by(system.b[3 * m], system.b[3 * m + 1], system.b[3 * m + 2]);
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
