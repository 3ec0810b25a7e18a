#include "physics/relax/segment_step.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <type_traits>

#include "physics/geometry/maths.h"
#include "physics/relax/small_solve.h"

namespace physics {
namespace {

using Tangents = std::array<Vec3, most_varied_segments>;

constexpr int most_turns = 2 * most_varied_segments;
constexpr int any = 0;  // a number of segments known only at run time

/// As in small_solve.h, for any number of rows.
using physics::cholesky, physics::solve_cholesky, physics::solve_lu;
using AnyMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_turns, most_turns>;
using AnyVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_turns, 1>;
bool cholesky(AnyMatrix& a) {
    const Eigen::LLT<AnyMatrix> factors(a);
    a = factors.matrixLLT();
    return factors.info() == Eigen::Success;
}
void solve_cholesky(const AnyMatrix& l, AnyVector& x) {
    assert(l.rows() == x.size() && l.diagonal().minCoeff() > 0);
    l.triangularView<Eigen::Lower>().solveInPlace(x);
    l.adjoint().triangularView<Eigen::Upper>().solveInPlace(x);
}
void solve_lu(const AnyMatrix& a, AnyVector& x) {
    x = a.partialPivLu().solve(AnyVector(x));
}

/// Model at one point of the iteration, in the planes ⟂ v_m, of `Fixed` segments or any number of them.
/// Four and five, which only a study asks for, share one code that takes less time to compile.
template <int Fixed>
struct Newton {
    using Vector = std::conditional_t<Fixed != any, Column<2 * Fixed>, AnyVector>;
    using Matrix = std::conditional_t<Fixed != any, Square<2 * Fixed>, AnyMatrix>;
    using Basis = Eigen::Matrix<double, 3, 2>;

    const SegmentProblem& problem;
    const int M = Fixed != any ? Fixed : problem.count;
    Tangents v;
    std::array<double, most_varied_segments> sigma{};
    std::array<Basis, most_varied_segments> basis;
    std::array<Vec3, most_varied_segments> slope;  // Σ_n P_mn (v_n − u_n) − q_m

    explicit Newton(const SegmentProblem& p) : problem(p) {
        assert(p.count >= 1 && p.count <= most_varied_segments && (Fixed == any || p.count == Fixed));
    }

    void linearise() {
        for (int m = 0; m < M; ++m) {
            slope[m] = -problem.pull[m];
            for (int n = 0; n < M; ++n) slope[m] += problem.curvature[m][n] * (v[n] - problem.tangent[n]);
            Vec3 a, b;
            tangent_basis(v[m], a, b);
            assert(!(std::abs(a.dot(b)) > 1e-9));
            basis[m].col(0) = a;
            basis[m].col(1) = b;
        }
    }
    Vector gradient() const {
        Vector g(2 * M);
        for (int m = 0; m < M; ++m) g.template segment<2>(2 * m) = basis[m].transpose() * slope[m];
        return g;
    }
    Matrix hessian() const {
        Matrix h(2 * M, 2 * M);
        for (int m = 0; m < M; ++m)
            for (int n = 0; n < M; ++n)
                h.template block<2, 2>(2 * m, 2 * n) =
                    basis[m].transpose() * problem.curvature[m][n] * basis[n];
        for (int m = 0; m < M; ++m) h.template block<2, 2>(2 * m, 2 * m).diagonal().array() += sigma[m];
        return h;
    }
    Tangents turned(const Vector& alpha) const {
        assert(alpha.size() == 2 * M);
        Tangents w = v;
        for (int m = 0; m < M; ++m) w[m] = (v[m] + basis[m] * alpha.template segment<2>(2 * m)).normalized();
        return w;
    }
};

template <int Fixed>
SegmentSolution plain(const SegmentProblem& problem, int most_iterations) {
    Newton<Fixed> newton(problem);
    const int M = newton.M;
    assert(M >= 1 && M <= most_varied_segments);
    for (int m = 0; m < M; ++m) {
        newton.sigma[m] = problem.pull[m].norm();
        newton.v[m] = newton.sigma[m] > 1e-300 ? Vec3(problem.pull[m] / newton.sigma[m]) : problem.tangent[m];
    }
    SegmentSolution solution;
    assert(most_iterations >= 1);
    while (solution.iterations < most_iterations && !solution.converged) {
        newton.linearise();
        typename Newton<Fixed>::Matrix hessian = newton.hessian();
        typename Newton<Fixed>::Vector alpha = -newton.gradient();
        solve_lu(hessian, alpha);
        if (!alpha.allFinite()) break;
        std::array<Vec3, most_varied_segments> delta;
        for (int m = 0; m < M; ++m) delta[m] = newton.basis[m] * alpha.template segment<2>(2 * m);
        for (int m = 0; m < M; ++m) {  // last row block of Eq. 33 eliminated
            Vec3 force = newton.slope[m] + newton.sigma[m] * newton.v[m];
            for (int n = 0; n < M; ++n) force += problem.curvature[m][n] * delta[n];
            newton.sigma[m] -= newton.v[m].dot(force);
        }
        newton.v = newton.turned(alpha);
        ++solution.iterations;
        solution.converged = alpha.template lpNorm<Eigen::Infinity>() < 1e-14;
    }
    solution.tangent = newton.v;
    solution.multiplier = newton.sigma;
    return solution;
}

/// Factor of the Hessian, shifted until it is positive definite; false where no shift of its scale makes it
/// so.
template <class Matrix>
bool shifted_cholesky(const Matrix& hessian, double scale, Matrix& factor) {
    assert(scale > 0);
    for (double shift = 1e-3 * scale;; shift *= 4) {
        factor = hessian;
        for (int i = 0; i < hessian.rows(); ++i) factor(i, i) += shift;
        if (cholesky(factor)) return true;
        if (shift > 1e6 * scale) return false;
    }
}

/// Takes the longest of the turns α, α/2, … that lowers the model's energy; false where none of twelve does.
template <int Fixed>
bool take_lower(Newton<Fixed>& newton, typename Newton<Fixed>::Vector alpha, double& energy) {
    assert(alpha.allFinite());
    for (int attempt = 0; attempt < 12; ++attempt, alpha *= 0.5) {
        const Tangents trial = newton.turned(alpha);
        const double trial_energy = model_energy(newton.problem, trial);
        if (!(trial_energy < energy)) continue;
        newton.v = trial;
        energy = trial_energy;
        return true;
    }
    return false;
}

template <int Fixed>
SegmentSolution descending(const SegmentProblem& problem, int most_iterations) {
    Newton<Fixed> newton(problem);
    const int M = newton.M;
    newton.v = problem.tangent;
    assert(M >= 1 && M <= most_varied_segments);
    double scale = 0;
    for (int m = 0; m < M; ++m)
        scale = std::max({scale, problem.pull[m].norm(), problem.curvature[m][m].trace()});
    SegmentSolution solution;
    double energy = 0;
    bool kicked = false;
    while (solution.iterations < most_iterations && !solution.converged && scale > 0) {
        newton.linearise();
        for (int m = 0; m < M; ++m) newton.sigma[m] = -newton.v[m].dot(newton.slope[m]);
        const auto gradient = newton.gradient();
        const auto hessian = newton.hessian();
        auto factor = hessian;
        const bool shifted = !cholesky(factor);
        ++solution.iterations;
        if (shifted) {
            if (!kicked && gradient.template lpNorm<Eigen::Infinity>() <= 1e-12 * scale) {
                // On the axis of a wall met head-on, or an exact fold: balanced, but no minimum.
                typename Newton<Fixed>::Vector kick = Newton<Fixed>::Vector::Zero(2 * M);
                kick[0] = 1e-3, kick[1] = 0.6e-3;
                newton.v = newton.turned(kick);
                energy = model_energy(problem, newton.v);
                kicked = true;
                continue;
            }
            if (!shifted_cholesky(hessian, scale, factor)) break;
        }
        typename Newton<Fixed>::Vector alpha = -gradient;
        solve_cholesky(factor, alpha);
        if (!alpha.allFinite()) break;
        const double size = alpha.template lpNorm<Eigen::Infinity>();
        solution.converged = size < 1e-14;
        if (size < 1e-5 && !shifted) {  // too short to show in a difference of energies
            newton.v = newton.turned(alpha);
            energy = model_energy(problem, newton.v);
            continue;
        }
        if (!take_lower(newton, alpha, energy)) {
            solution.converged = true;  // as low as rounding allows
            break;
        }
    }
    // It starts at 0 and falls, but for the kick and for steps too short to show.
    assert(!(model_energy(problem, newton.v) > 1e-4 * scale));
    solution.tangent = newton.v;
    solution.multiplier = newton.sigma;
    return solution;
}

}  // namespace

double model_energy(const SegmentProblem& p, const Tangents& v) {
    assert(p.count >= 1 && p.count <= most_varied_segments);
    double energy = 0;
    Tangents e;
    for (int m = 0; m < p.count; ++m) e[m] = v[m] - p.tangent[m];
    for (int m = 0; m < p.count; ++m) {
        Vec3 slope = -p.pull[m];
        for (int n = 0; n < p.count; ++n) slope += 0.5 * (p.curvature[m][n] * e[n]);
        energy += e[m].dot(slope);
    }
    return energy;
}

SegmentSolution plain_step(const SegmentProblem& p, int most_iterations) {
    switch (p.count) {
        case 1:
            return plain<1>(p, most_iterations);
        case 2:
            return plain<2>(p, most_iterations);
        case 3:
            return plain<3>(p, most_iterations);
        default:
            return plain<any>(p, most_iterations);
    }
}

SegmentSolution descending_step(const SegmentProblem& p, int most_iterations) {
    switch (p.count) {
        case 1:
            return descending<1>(p, most_iterations);
        case 2:
            return descending<2>(p, most_iterations);
        case 3:
            return descending<3>(p, most_iterations);
        default:
            return descending<any>(p, most_iterations);
    }
}

Vec3 small_turn_step(const SegmentProblem& p, double sigma) {
    assert(p.count == 1 && sigma > 0);
    Newton<1> newton(p);
    newton.v = p.tangent;
    newton.sigma[0] = sigma;
    newton.linearise();
    Square<2> factor = newton.hessian();
    Column<2> alpha = -newton.gradient();
    cholesky(factor);
    solve_cholesky(factor, alpha);
    return newton.turned(alpha)[0];
}

double largest_fraction(const Vec3& u, const Vec3& v, double limit) {
    assert(limit > 0);
    if (limit >= 2 || (v - u).norm() <= limit) return 1.0;
    // The blend (1−α)u + αv turns by φ when α = sin φ / (sin φ + sin(θ−φ)).
    const double theta = geometry::atan2(u.cross(v).norm(), u.dot(v));
    const double phi = 2 * geometry::asin(0.5 * limit);
    // Of a turn that is at the limit but for rounding, all.
    const double fraction =
        std::min(1.0, geometry::sin(phi) / (geometry::sin(phi) + geometry::sin(theta - phi)));
    assert(fraction > 0);
    return fraction;
}

Vec3 limited_turn(const Vec3& u, const Vec3& v, double alpha) {
    assert(alpha >= 0);
    if (alpha >= 1) return v;
    const Vec3 blend = (1 - alpha) * u + alpha * v;
    const double length = blend.norm();
    assert(length < 1 + 1e-6);  // a chord of the sphere
    if (length > 1e-9) return blend / length;
    Vec3 a, b;  // v = −u exactly: any way round will do
    tangent_basis(u, a, b);
    return (u + alpha * a).normalized();
}

}  // namespace physics
