#include "physics/relax/geometric_step.h"

#include <Eigen/Cholesky>
#include <Eigen/Householder>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace physics {
namespace {

constexpr int turns_of_a_piece = 2 * closed_segments;  // turns of a piece
using Turns = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, turns_of_a_piece, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, turns_of_a_piece, turns_of_a_piece>;
using Closure = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, turns_of_a_piece>;  // d(Σ λ v)/dα
using Basis = Eigen::Matrix<double, 3, 2>;

Basis basis_of(const Vec3& u) {
    Vec3 a, b;
    tangent_basis(u, a, b);
    assert(std::abs(a.dot(b)) < 1e-9 && std::abs(b.squaredNorm() - 1) < 1e-9);
    Basis basis;
    basis << a, b;
    return basis;
}

/// The minimum of g·α + ½ α·H·α, H made positive definite by a shift where it is not.
Turns newton(Matrix h, const Turns& g) {
    assert(h.rows() == g.size() && h.cols() == g.size());
    const double scale = std::max(h.diagonal().cwiseAbs().maxCoeff(), 1e-300);
    Eigen::LLT<Matrix> cholesky(h);
    for (double shift = 1e-3 * scale; cholesky.info() != Eigen::Success && shift < 1e6 * scale; shift *= 4) {
        h.diagonal().array() += shift;
        cholesky.compute(h);
    }
    const Turns turns =
        cholesky.info() == Eigen::Success ? Turns(cholesky.solve(-g)) : Turns(Turns::Zero(g.size()));
    assert(!(g.dot(turns) > 1e-9 * g.norm() * turns.norm()));  // it leads down
    return turns;
}

/// Turns that keep the closure to first order: the columns of Q after the third, where closureᵀ = QR, by
/// reflections. Eigen's own class takes four times as long to compile.
Matrix kept_turns(const Closure& closure) {
    assert(closure.cols() > 3);
    const Eigen::Index turns = closure.cols();
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, turns_of_a_piece, 3> r = closure.transpose();
    Vec3 tau;
    std::array<double, turns_of_a_piece> workspace;
    for (Eigen::Index k = 0; k < 3; ++k) {
        double beta;
        r.col(k).tail(turns - k).makeHouseholderInPlace(tau[k], beta);
        r(k, k) = beta;
        r.bottomRightCorner(turns - k, 2 - k)
            .applyHouseholderOnTheLeft(r.col(k).tail(turns - k - 1), tau[k], workspace.data());
    }
    Matrix q = Matrix::Identity(turns, turns);
    for (Eigen::Index k = 2; k >= 0; --k)
        q.bottomRightCorner(turns - k, turns - k)
            .applyHouseholderOnTheLeft(r.col(k).tail(turns - k - 1), tau[k], workspace.data());
    assert(std::abs(q.col(turns - 1).squaredNorm() - 1) < 1e-9);
    return q.rightCols(turns - 3);
}

Vec3 solved(const Mat3& square, const Vec3& right) {
    assert(!(square.diagonal().minCoeff() < 0));  // of closure·closureᵀ
    return square.ldlt().solve(right);
}

}  // namespace

GeometricStep::GeometricStep(const SegmentProblem& p, const std::array<double, closed_segments>& lengths,
                             bool closed)
    : start_(p.tangent), lengths_(lengths), count_(p.count), closed_(closed) {
    assert(count_ >= 1 && count_ <= closed_segments && (!closed_ || count_ == closed_segments));
    const int turns = 2 * count_;
    std::array<Basis, closed_segments> basis;
    Turns g(turns);
    Matrix h(turns, turns);
    Closure closure(3, turns);
    for (int m = 0; m < count_; ++m) {
        basis[m] = basis_of(start_[m]);
        g.segment<2>(2 * m) = -(basis[m].transpose() * p.pull[m]);
        closure.middleCols<2>(2 * m) = lengths_[m] * basis[m];
    }
    for (int m = 0; m < count_; ++m)
        for (int n = 0; n < count_; ++n)
            h.block<2, 2>(2 * m, 2 * n) = basis[m].transpose() * p.curvature[m][n] * basis[n];

    // Where |v| = 1 and the closure hold, their multipliers σ and μ bend the model: σ_m = v·(q − λ_m μ).
    Vec3 mu = Vec3::Zero();
    if (closed_) {
        const Mat3 square = closure * closure.transpose();
        mu = -solved(square + 1e-12 * square.trace() * Mat3::Identity(), closure * g);
    }
    for (int m = 0; m < count_; ++m)
        h.block<2, 2>(2 * m, 2 * m).diagonal().array() += start_[m].dot(p.pull[m] - lengths_[m] * mu);

    Turns alpha;
    if (closed_) {
        const Matrix free = kept_turns(closure);
        alpha = free * newton(free.transpose() * h * free, free.transpose() * g);
        assert(!((closure * alpha).norm() > 1e-9 * closure.norm() * alpha.norm()));
    } else {
        alpha = newton(h, g);
    }
    for (int m = 0; m < count_; ++m) {
        step_[m] = basis[m] * alpha.segment<2>(2 * m);
        assert(!(std::abs(step_[m].dot(start_[m])) > 1e-9 * step_[m].norm()));
        largest_ = std::max(largest_, step_[m].norm());
        finite_ = finite_ && step_[m].allFinite();
    }
}

std::optional<GeometricStep::Tangents> GeometricStep::turned(double fraction, double limit) const {
    assert(fraction > 0 && limit > 0);
    if (!finite_ || !(largest_ > 0)) return std::nullopt;
    fraction = std::min(fraction, 0.9 * limit / largest_);  // closing turns a little more
    Tangents v = start_;
    for (int m = 0; m < count_; ++m) {
        v[m] = (start_[m] + fraction * step_[m]).normalized();
        assert((v[m] - start_[m]).norm() <= limit);
    }
    if (!closed_) return v;
    const auto closed = closed_by_turning(v);
    for (int m = 0; closed && m < count_; ++m)
        if (!(((*closed)[m] - start_[m]).norm() <= limit)) return std::nullopt;
    return closed;
}

/// The least turns that bring the piece back to its end, by Newton.
std::optional<GeometricStep::Tangents> GeometricStep::closed_by_turning(Tangents v) const {
    assert(closed_ && count_ >= 2);
    double size = 0;
    Vec3 chord = Vec3::Zero();
    for (int m = 0; m < count_; ++m) chord += lengths_[m] * start_[m], size += lengths_[m];
    for (int iteration = 0; iteration < 12; ++iteration) {
        Vec3 gap = chord;
        Mat3 square = Mat3::Zero();
        for (int m = 0; m < count_; ++m) {
            gap -= lengths_[m] * v[m];
            square += lengths_[m] * lengths_[m] * (Mat3::Identity() - v[m] * v[m].transpose());
        }
        if (gap.norm() < 1e-15 * size) return v;
        const Vec3 correction = solved(square, gap);
        if (!correction.allFinite()) return std::nullopt;
        for (int m = 0; m < count_; ++m)
            v[m] = (v[m] + lengths_[m] * (correction - correction.dot(v[m]) * v[m])).normalized();
    }
    return std::nullopt;
}

}  // namespace physics
