#include "physics/riccati.h"

#include <algorithm>
#include <cmath>

namespace physics {
namespace {

struct Pivot {
    double least;  // lower eigenvalue
    Vec2 way;      // its unit eigenvector
};

Pivot lower_eigenpair(double a, double b, double c) {  // of [a b; b c]
    const double mean = 0.5 * (a + c), half = 0.5 * (a - c), root = std::hypot(half, b);
    Pivot p{mean - root, Vec2::UnitX()};
    const Vec2 way(b, p.least - a);
    const Vec2 other(p.least - c, b);
    const Vec2& longer = way.squaredNorm() > other.squaredNorm() ? way : other;
    if (longer.squaredNorm() > 0) p.way = longer.normalized();
    return p;
}

template <bool Twist>
RiccatiReport backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                       std::span<RiccatiGain> gains) {
    RiccatiReport report;
    Mat3 P = Mat3::Zero();
    Mat32 Px = Mat32::Zero();
    Mat2 Pa = Mat2::Zero();
    Vec3 p = Vec3::Zero();
    Vec2 pa = Vec2::Zero();
    Vec3 v = Vec3::Zero();  // twist: cross terms with δx and α, own curvature and slope
    Vec2 w = Vec2::Zero();
    double c = 0, p_twist = 0;

    for (int j = static_cast<int>(stages.size()) - 1; j >= 0; --j) {
        const RiccatiStage& s = stages[j];
        const double lambda = s.length;
        if (s.touches) {
            P += s.stiffness;
            p += s.force;
        }
        P.diagonal().array() += mu * lambda;

        const Mat32& T = s.basis;
        Mat32 Y = Px;
        Y.noalias() += lambda * (P * T);
        Mat2 Q = Pa + s.own;
        Q.noalias() += lambda * (T.transpose() * Y);
        Q.noalias() += lambda * (Px.transpose() * T);
        Q(0, 0) -= s.axial;
        Q(1, 1) -= s.axial;
        Vec2 g = pa + s.slope;
        g.noalias() += lambda * (T.transpose() * p);
        Mat2 X = s.cross;
        Vec2 z = Vec2::Zero();
        if constexpr (Twist) {
            const Vec2 &hi = s.twist_prev, &hj = s.twist;
            const Vec2 turned = lambda * (T.transpose() * v) + w;  // answer of α_j to the twist itself
            Q.noalias() += turned * hj.transpose() + hj * turned.transpose() + c * hj * hj.transpose();
            Y.noalias() += v * hj.transpose();
            z = turned + c * hj;
            X.noalias() += hi * z.transpose();
            z += s.twist_cross;
            g += p_twist * hj;
        }

        const double q00 = Q(0, 0), q11 = Q(1, 1), q01 = 0.5 * (Q(0, 1) + Q(1, 0));
        const double det = q00 * q11 - q01 * q01;
        Mat2 inverse;
        if (q00 > 0 && det > 0) {
            inverse << q11 / det, -q01 / det, -q01 / det, q00 / det;
        } else {
            // Negative curvature is mirrored: as long a step as along an equally positive one. The other way
            // of the segment keeps its own, so that a wire balanced in one plane still converges in the
            // other.
            const Pivot pivot = lower_eigenpair(q00, q01, q11);
            if (report.shifted++ == 0) {
                report.stage = j;
                report.way = pivot.way;
            }
            const double low = std::max(least_pivot, std::abs(pivot.least));
            const double high = std::max(least_pivot, std::abs(q00 + q11 - pivot.least));
            inverse = Mat2::Identity() / high + (1 / low - 1 / high) * pivot.way * pivot.way.transpose();
        }

        RiccatiGain& gain = gains[j];
        const Mat2 minus = -inverse;
        gain.step.noalias() = minus * g;
        gain.from_x.noalias() = minus * Y.transpose();
        gain.from_prev.noalias() = minus * X.transpose();
        P.noalias() += Y * gain.from_x;
        p.noalias() += Y * gain.step;
        Px.noalias() = Y * gain.from_prev;
        Pa = s.prev_prev;
        Pa.noalias() += X * gain.from_prev;
        pa = s.slope_prev;
        pa.noalias() += X * gain.step;
        if constexpr (Twist) {
            const Vec2& hi = s.twist_prev;
            gain.from_twist.noalias() = minus * z;
            Px.noalias() += v * hi.transpose();
            Pa.noalias() += c * hi * hi.transpose();
            pa += p_twist * hi;
            w = c * hi + s.twist_cross_prev + X * gain.from_twist;
            v += Y * gain.from_twist;
            p_twist += s.slope_twist + z.dot(gain.step);
            c += s.twist_twist + z.dot(gain.from_twist);
        }
    }
    return report;
}

}  // namespace

RiccatiReport riccati_backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                               bool twist, std::span<RiccatiGain> gains) {
    return twist ? backward<true>(stages, mu, least_pivot, gains)
                 : backward<false>(stages, mu, least_pivot, gains);
}

}  // namespace physics
