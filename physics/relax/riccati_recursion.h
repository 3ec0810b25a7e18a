#pragma once
/// One stage of the Riccati recursion at a time, for loops that make a stage just before it is used: the work
/// of making it then runs while the recursion waits for its own last result.

#include <algorithm>
#include <cmath>

#include "physics/relax/riccati.h"

namespace physics {

/// Minus the inverse of the 2×2 block [q00 q01; q01 q11], which is not positive definite. Negative curvature
/// is mirrored: the step is as long as along an equally positive one. The segment's other direction keeps its
/// own curvature, so that a wire balanced in one plane still converges in the other.
SymmetricBlock minus_mirrored_inverse(double q00, double q01, double q11, double least_pivot, int stage,
                                      RiccatiReport&);

/// The value function carried from the tip to the base, in scalars: P and P_a by their upper triangles, P_x
/// by its two columns. Everything that belongs to a twist which there is not is left out.
template <Twist twist>
class RiccatiRecursion {
    static constexpr bool with_twist = twist != Twist::None, with_second = twist == Twist::Two;

public:
    RiccatiRecursion(double mu, double least_pivot) : mu_(mu), least_pivot_(least_pivot) {}

    RiccatiReport report() const {
        RiccatiReport report = report_;
        report.slope_twist = slope_twist_;
        report.twist_twist = twist_twist_;
        report.slope_second = slope_second_;
        report.twist_second = twist_second_;
        report.second_second = second_second_;
        return report;
    }
    const Vec3& slope_x() const { return p_; }           // p
    Vec2 slope_turn() const { return {r0_, r1_}; }       // p_a
    double slope_twist() const { return slope_twist_; }  // p_ψ

    /// Adds the stage's wall and trust region; the first call for a stage.
    [[gnu::always_inline]] void add_wall(const RiccatiStage& s) {
        if (s.touches) {
            const Mat3& h = s.stiffness;
            p00_ += h(0, 0), p01_ += h(0, 1), p02_ += h(0, 2);
            p11_ += h(1, 1), p12_ += h(1, 2), p22_ += h(2, 2);
            p_ += s.force;
        }
        const double trust = mu_ * s.length;
        p00_ += trust, p11_ += trust, p22_ += trust;
    }

    /// The joint of the stage moves by `by` in addition to what the turns do.
    void feed(const Vec3& by) {
        p_ += times_p(by);
        r0_ += x0_.dot(by), r1_ += x1_.dot(by);
        if constexpr (with_twist) slope_twist_ += v_.dot(by);
        if constexpr (with_second) slope_second_ += second_v_.dot(by);
    }

    /// Adds the grip on the stage's joint and eliminates the twist of its segment; after add_wall().
    [[gnu::always_inline]] void twist_segment(const RiccatiStage& s, const TwistStage& t, int index,
                                              TwistGain& gain) {
        v_ += t.grip_cross;
        twist_twist_ += t.grip_grip;
        slope_twist_ += t.grip_slope;
        double pivot = twist_twist_ + t.stiffness + mu_ * s.length * twist_arm * twist_arm;
        if (!(pivot > 0)) {
            if (report_.shifted++ == 0) report_.stage = index;
            pivot = std::max(least_pivot_, std::abs(pivot));
        }
        const double slope = slope_twist_ + t.slope, scale = -1 / pivot, c = twist_twist_;
        gain.step = scale * slope;
        gain.from_x = scale * v_;
        gain.from_turn = {scale * w0_, scale * w1_};
        gain.from_twist = scale * c;
        const Vec3& f = gain.from_x;
        p00_ += v_[0] * f[0], p01_ += v_[0] * f[1], p02_ += v_[0] * f[2];
        p11_ += v_[1] * f[1], p12_ += v_[1] * f[2], p22_ += v_[2] * f[2];
        p_ += slope * f;
        const double f0 = gain.from_turn[0], f1 = gain.from_turn[1];
        x0_ += f0 * v_, x1_ += f1 * v_;
        a00_ += w0_ * f0, a01_ += w0_ * f1, a11_ += w1_ * f1;
        r0_ += slope * f0, r1_ += slope * f1;
        const double left = 1 + gain.from_twist;
        slope_twist_ += c * gain.step;
        v_ *= left;
        w0_ *= left, w1_ *= left;
        twist_twist_ *= left;
    }

    /// Processes the stage `index`: computes its gain and the value function proximal of it.
    [[gnu::always_inline]] void step(const RiccatiStage& s, int index, RiccatiGain& gain) {
        const Vec3 a = s.length * s.basis.col(0), b = s.length * s.basis.col(1);
        Vec3 y0 = x0_ + times_p(a), y1 = x1_ + times_p(b);
        double q00 = a00_ + s.own(0, 0) - s.axial + a.dot(y0) + x0_.dot(a);
        double q01 = a01_ + s.own(0, 1) + a.dot(y1) + x0_.dot(b);
        double q11 = a11_ + s.own(1, 1) - s.axial + b.dot(y1) + x1_.dot(b);
        double g0 = r0_ + s.slope[0] + a.dot(p_), g1 = r1_ + s.slope[1] + b.dot(p_);
        double c00 = s.cross(0, 0), c01 = s.cross(0, 1), c10 = s.cross(1, 0), c11 = s.cross(1, 1);
        [[maybe_unused]] double z0 = 0, z1 = 0, second0 = 0, second1 = 0;
        if constexpr (with_twist) {
            const double h0 = s.twist[0], h1 = s.twist[1], i0 = s.twist_prev[0], i1 = s.twist_prev[1];
            if constexpr (with_second) {
                second0 = a.dot(second_v_) + second_w0_ + twist_second_ * h0 + s.second_cross[0];
                second1 = b.dot(second_v_) + second_w1_ + twist_second_ * h1 + s.second_cross[1];
            }
            z0 = a.dot(v_) + w0_, z1 = b.dot(v_) + w1_;  // answer of α_j to the twist itself
            q00 += (2 * z0 + twist_twist_ * h0) * h0;
            q01 += z0 * h1 + (z1 + twist_twist_ * h1) * h0;
            q11 += (2 * z1 + twist_twist_ * h1) * h1;
            y0 += h0 * v_, y1 += h1 * v_;
            z0 += twist_twist_ * h0, z1 += twist_twist_ * h1;
            c00 += i0 * z0, c01 += i0 * z1, c10 += i1 * z0, c11 += i1 * z1;
            z0 += s.twist_cross[0], z1 += s.twist_cross[1];
            g0 += slope_twist_ * h0, g1 += slope_twist_ * h1;
        }

        const double det = q00 * q11 - q01 * q01;
        SymmetricBlock& i = gain.inverse;
        if (q00 > 0 && det > 0) {
            const double scale = -1 / det;
            i = {q11 * scale, -q01 * scale, q00 * scale};
        } else {
            i = minus_mirrored_inverse(q00, q01, q11, least_pivot_, index, report_);
        }
        const double t0 = i.a * g0 + i.b * g1, t1 = i.b * g0 + i.c * g1;
        gain.step = {t0, t1};
        const Vec3 f0 = i.a * y0 + i.b * y1, f1 = i.b * y0 + i.c * y1;
        gain.from_x.row(0) = f0, gain.from_x.row(1) = f1;
        const double v00 = i.a * c00 + i.b * c01, v01 = i.a * c10 + i.b * c11;
        const double v10 = i.b * c00 + i.c * c01, v11 = i.b * c10 + i.c * c11;
        gain.from_prev << v00, v01, v10, v11;

        p00_ += y0[0] * f0[0] + y1[0] * f1[0], p01_ += y0[0] * f0[1] + y1[0] * f1[1];
        p02_ += y0[0] * f0[2] + y1[0] * f1[2], p11_ += y0[1] * f0[1] + y1[1] * f1[1];
        p12_ += y0[1] * f0[2] + y1[1] * f1[2], p22_ += y0[2] * f0[2] + y1[2] * f1[2];
        p_ += t0 * y0 + t1 * y1;
        x0_ = v00 * y0 + v10 * y1;
        x1_ = v01 * y0 + v11 * y1;
        a00_ = s.prev_prev(0, 0) + c00 * v00 + c01 * v10;
        a01_ = s.prev_prev(0, 1) + c00 * v01 + c01 * v11;
        a11_ = s.prev_prev(1, 1) + c10 * v01 + c11 * v11;
        r0_ = s.slope_prev[0] + c00 * t0 + c01 * t1;
        r1_ = s.slope_prev[1] + c10 * t0 + c11 * t1;
        if constexpr (with_twist) {
            const double i0 = s.twist_prev[0], i1 = s.twist_prev[1], c = twist_twist_;
            const double e0 = i.a * z0 + i.b * z1, e1 = i.b * z0 + i.c * z1;
            gain.from_twist = {e0, e1};
            if constexpr (with_second) {
                const double d0 = i.a * second0 + i.b * second1, d1 = i.b * second0 + i.c * second1;
                gain.from_second = {d0, d1};
                second_v_ += d0 * y0 + d1 * y1;
                second_w0_ = twist_second_ * i0 + s.second_cross_prev[0] + c00 * d0 + c01 * d1;
                second_w1_ = twist_second_ * i1 + s.second_cross_prev[1] + c10 * d0 + c11 * d1;
                slope_second_ += s.second_slope + second0 * t0 + second1 * t1;
                twist_second_ += s.second_second + z0 * d0 + z1 * d1;
                second_second_ += s.second_second + second0 * d0 + second1 * d1;
            }
            x0_ += i0 * v_, x1_ += i1 * v_;
            a00_ += c * i0 * i0, a01_ += c * i0 * i1, a11_ += c * i1 * i1;
            r0_ += slope_twist_ * i0, r1_ += slope_twist_ * i1;
            w0_ = c * i0 + s.twist_cross_prev[0] + c00 * e0 + c01 * e1;
            w1_ = c * i1 + s.twist_cross_prev[1] + c10 * e0 + c11 * e1;
            v_ += e0 * y0 + e1 * y1;
            slope_twist_ += s.slope_twist + z0 * t0 + z1 * t1;
            twist_twist_ += s.twist_twist + z0 * e0 + z1 * e1;
        }
    }

private:
    Vec3 times_p(const Vec3& d) const {
        return {p00_ * d[0] + p01_ * d[1] + p02_ * d[2], p01_ * d[0] + p11_ * d[1] + p12_ * d[2],
                p02_ * d[0] + p12_ * d[1] + p22_ * d[2]};
    }

    double mu_, least_pivot_;
    double p00_ = 0, p01_ = 0, p02_ = 0, p11_ = 0, p12_ = 0, p22_ = 0;
    Vec3 x0_ = Vec3::Zero(), x1_ = Vec3::Zero(), p_ = Vec3::Zero();
    double a00_ = 0, a01_ = 0, a11_ = 0, r0_ = 0, r1_ = 0;
    Vec3 v_ = Vec3::Zero();  // twist: cross terms with δx and α, own curvature and slope
    double w0_ = 0, w1_ = 0, twist_twist_ = 0, slope_twist_ = 0;
    Vec3 second_v_ = Vec3::Zero();  // the same of a second device's turn, and its cross term with ψ
    double second_w0_ = 0, second_w1_ = 0, twist_second_ = 0, second_second_ = 0, slope_second_ = 0;
    RiccatiReport report_;
};

}  // namespace physics
