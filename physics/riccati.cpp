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

/// Negative curvature is mirrored: as long a step as along an equally positive one. The other way of the
/// segment keeps its own, so that a wire balanced in one plane still converges in the other.
Mat2 mirrored_inverse(double q00, double q01, double q11, double least_pivot, int stage,
                      RiccatiReport& report) {
    const Pivot pivot = lower_eigenpair(q00, q01, q11);
    if (report.shifted++ == 0) {
        report.stage = stage;
        report.way = pivot.way;
    }
    const double low = std::max(least_pivot, std::abs(pivot.least));
    const double high = std::max(least_pivot, std::abs(q00 + q11 - pivot.least));
    return Mat2::Identity() / high + (1 / low - 1 / high) * pivot.way * pivot.way.transpose();
}

RiccatiReport backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                       std::span<RiccatiGain> gains, std::span<const FedStage> fed) {
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
        for (const FedStage& f : fed) {
            if (f.stage != j) continue;
            p += P * f.by;
            pa += Px.transpose() * f.by;
            p_twist += v.dot(f.by);
        }

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
        const Vec2 &hi = s.twist_prev, &hj = s.twist;
        const Vec2 turned = lambda * (T.transpose() * v) + w;  // answer of α_j to the twist itself
        Q.noalias() += turned * hj.transpose() + hj * turned.transpose() + c * hj * hj.transpose();
        Y.noalias() += v * hj.transpose();
        Vec2 z = turned + c * hj;
        X.noalias() += hi * z.transpose();
        z += s.twist_cross;
        g += p_twist * hj;

        const double q00 = Q(0, 0), q11 = Q(1, 1), q01 = 0.5 * (Q(0, 1) + Q(1, 0));
        const double det = q00 * q11 - q01 * q01;
        Mat2 inverse;
        if (q00 > 0 && det > 0) {
            inverse << q11 / det, -q01 / det, -q01 / det, q00 / det;
        } else {
            inverse = mirrored_inverse(q00, q01, q11, least_pivot, j, report);
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
        gain.from_twist.noalias() = minus * z;
        Px.noalias() += v * hi.transpose();
        Pa.noalias() += c * hi * hi.transpose();
        pa += p_twist * hi;
        w = c * hi + s.twist_cross_prev + X * gain.from_twist;
        v += Y * gain.from_twist;
        p_twist += s.slope_twist + z.dot(gain.step);
        c += s.twist_twist + z.dot(gain.from_twist);
    }
    return report;
}

/// The same without twist, in scalars: P and P_a by their upper triangles, P_x by its two columns.
RiccatiReport backward_untwisted(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                                 std::span<RiccatiGain> gains, std::span<const FedStage> fed) {
    RiccatiReport report;
    double p00 = 0, p01 = 0, p02 = 0, p11 = 0, p12 = 0, p22 = 0;
    Vec3 x0 = Vec3::Zero(), x1 = Vec3::Zero(), p = Vec3::Zero();
    double a00 = 0, a01 = 0, a11 = 0, r0 = 0, r1 = 0;  // P_a, p_a
    for (int j = static_cast<int>(stages.size()) - 1; j >= 0; --j) {
        const RiccatiStage& s = stages[j];
        const double lambda = s.length;
        if (s.touches) {
            const Mat3& h = s.stiffness;
            p00 += h(0, 0), p01 += h(0, 1), p02 += h(0, 2), p11 += h(1, 1), p12 += h(1, 2), p22 += h(2, 2);
            p += s.force;
        }
        p00 += mu * lambda, p11 += mu * lambda, p22 += mu * lambda;
        for (const FedStage& f : fed) {
            if (f.stage != j) continue;
            const Vec3& d = f.by;
            p += Vec3(p00 * d[0] + p01 * d[1] + p02 * d[2], p01 * d[0] + p11 * d[1] + p12 * d[2],
                      p02 * d[0] + p12 * d[1] + p22 * d[2]);
            r0 += x0.dot(d), r1 += x1.dot(d);
        }

        const Vec3 a = lambda * s.basis.col(0), b = lambda * s.basis.col(1);
        const Vec3 y0(x0[0] + p00 * a[0] + p01 * a[1] + p02 * a[2],
                      x0[1] + p01 * a[0] + p11 * a[1] + p12 * a[2],
                      x0[2] + p02 * a[0] + p12 * a[1] + p22 * a[2]);
        const Vec3 y1(x1[0] + p00 * b[0] + p01 * b[1] + p02 * b[2],
                      x1[1] + p01 * b[0] + p11 * b[1] + p12 * b[2],
                      x1[2] + p02 * b[0] + p12 * b[1] + p22 * b[2]);
        const double q00 = a00 + s.own(0, 0) - s.axial + a.dot(y0) + x0.dot(a);
        const double q01 = a01 + s.own(0, 1) + a.dot(y1) + x0.dot(b);
        const double q11 = a11 + s.own(1, 1) - s.axial + b.dot(y1) + x1.dot(b);
        const double g0 = r0 + s.slope[0] + a.dot(p), g1 = r1 + s.slope[1] + b.dot(p);

        const double det = q00 * q11 - q01 * q01;
        double i00, i01, i11;  // of minus the inverse
        if (q00 > 0 && det > 0) {
            const double scale = -1 / det;
            i00 = q11 * scale, i01 = -q01 * scale, i11 = q00 * scale;
        } else {
            const Mat2 minus = -mirrored_inverse(q00, q01, q11, least_pivot, j, report);
            i00 = minus(0, 0), i01 = minus(0, 1), i11 = minus(1, 1);
        }
        RiccatiGain& gain = gains[j];
        const double t0 = i00 * g0 + i01 * g1, t1 = i01 * g0 + i11 * g1;
        gain.step = {t0, t1};
        const Vec3 f0 = i00 * y0 + i01 * y1, f1 = i01 * y0 + i11 * y1;
        gain.from_x.row(0) = f0, gain.from_x.row(1) = f1;
        const Mat2& c = s.cross;
        const double v00 = i00 * c(0, 0) + i01 * c(0, 1), v01 = i00 * c(1, 0) + i01 * c(1, 1),
                     v10 = i01 * c(0, 0) + i11 * c(0, 1), v11 = i01 * c(1, 0) + i11 * c(1, 1);
        gain.from_prev << v00, v01, v10, v11;
        p00 += y0[0] * f0[0] + y1[0] * f1[0], p01 += y0[0] * f0[1] + y1[0] * f1[1];
        p02 += y0[0] * f0[2] + y1[0] * f1[2], p11 += y0[1] * f0[1] + y1[1] * f1[1];
        p12 += y0[1] * f0[2] + y1[1] * f1[2], p22 += y0[2] * f0[2] + y1[2] * f1[2];
        p += t0 * y0 + t1 * y1;
        x0 = v00 * y0 + v10 * y1;
        x1 = v01 * y0 + v11 * y1;
        a00 = s.prev_prev(0, 0) + c(0, 0) * v00 + c(0, 1) * v10;
        a01 = s.prev_prev(0, 1) + c(0, 0) * v01 + c(0, 1) * v11;
        a11 = s.prev_prev(1, 1) + c(1, 0) * v01 + c(1, 1) * v11;
        r0 = s.slope_prev[0] + c(0, 0) * t0 + c(0, 1) * t1;
        r1 = s.slope_prev[1] + c(1, 0) * t0 + c(1, 1) * t1;
    }
    return report;
}

}  // namespace

RiccatiReport riccati_backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                               bool twist, std::span<RiccatiGain> gains, std::span<const FedStage> fed) {
    return twist ? backward(stages, mu, least_pivot, gains, fed)
                 : backward_untwisted(stages, mu, least_pivot, gains, fed);
}

}  // namespace physics
