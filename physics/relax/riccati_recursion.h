#pragma once
/// One stage of the Riccati recursion at a time, for loops that make a stage just before it is used: the work
/// of making it then runs while the recursion waits for its own last result.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "physics/relax/riccati.h"

namespace physics {

/// Minus the inverse of the 2×2 block [q00 q01; q01 q11], which is not positive definite. Negative curvature
/// is mirrored: the step is as long as along an equally positive one. The segment's other direction keeps its
/// own curvature, so that a chain balanced in one plane still converges in the other.
SymmetricBlock minus_mirrored_inverse(double q00, double q01, double q11, double least_pivot, int stage,
                                      RiccatiReport&);

/// Calls use(std::integral_constant<int, F>()) for the number of frames.
template <class Use>
auto with_frames(int count, const Use& use) {
    static_assert(most_devices == 4);
    assert(count >= 0 && count <= most_devices);
    switch (count) {
        case 1:
            return use(std::integral_constant<int, 1>());
        case 2:
            return use(std::integral_constant<int, 2>());
        case 3:
            return use(std::integral_constant<int, 3>());
        case 4:
            return use(std::integral_constant<int, 4>());
        default:
            return use(std::integral_constant<int, 0>());
    }
}

/// The value function carried from the tip to the base, in scalars: P and P_a by their upper triangles, P_x
/// by its two columns. Terms of absent frames are compiled out.
template <int F>
class RiccatiRecursion {
    static constexpr int frames = F > 0 ? F : 1;  // no array is empty

public:
    RiccatiRecursion(double mu, double least_pivot) : mu_(mu), least_pivot_(least_pivot) {
        for (Vec3& v : v_) v.setZero();
    }

    RiccatiReport report() const {
        RiccatiReport report = report_;
        for (int f = 0; f < F; ++f) {
            report.slope[f] = slope_[f];
            for (int g = 0; g < F; ++g) report.curve[f][g] = c_[f][g];
        }
        return report;
    }
    const Vec3& slope_x() const { return p_; }                           // p
    Vec2 slope_turn() const { return {r0_, r1_}; }                       // p_a
    const std::array<double, frames>& slopes() const { return slope_; }  // p_f

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
        for (int f = 0; f < F; ++f) slope_[f] += v_[f].dot(by);
    }

    /// Adds the grip on the stage's joint and eliminates the frames' twists of its segment; after add_wall().
    /// `frame` and `gains` are the stage's first.
    [[gnu::always_inline]] void twist_segment(const RiccatiStage& s, int index, const FrameStage* frame,
                                              FrameGain* gains) {
        for (int f = 0; f < F; ++f) {
            const FrameStage& t = frame[f];
            if (t.twist_stiffness == 0) continue;
            v_[f] += t.grip_cross;
            c_[f][f] += t.grip_grip;
            slope_[f] += t.grip_slope;
        }
        for (int f = 0; f < F; ++f) {
            const FrameStage& t = frame[f];
            if (t.twist_stiffness == 0) continue;
            double pivot = c_[f][f] + t.twist_stiffness + mu_ * s.length * twist_arm * twist_arm;
            if (!(pivot > 0)) {
                if (report_.shifted++ == 0) report_.stage = index, report_.frame = f;
                pivot = std::max(least_pivot_, std::abs(pivot));
            }
            FrameGain& gain = gains[f];
            const double slope = slope_[f] + t.twist_slope, give = -1 / pivot;
            gain.give = give;
            gain.step = give * slope;
            gain.from_x = give * v_[f];
            gain.from_turn = {give * w0_[f], give * w1_[f]};
            const Vec3 v = v_[f];
            const Vec3& x = gain.from_x;
            p00_ += v[0] * x[0], p01_ += v[0] * x[1], p02_ += v[0] * x[2];
            p11_ += v[1] * x[1], p12_ += v[1] * x[2], p22_ += v[2] * x[2];
            p_ += slope * x;
            const double t0 = gain.from_turn[0], t1 = gain.from_turn[1];
            x0_ += t0 * v, x1_ += t1 * v;
            a00_ += w0_[f] * t0, a01_ += w0_[f] * t1, a11_ += w1_[f] * t1;
            r0_ += slope * t0, r1_ += slope * t1;
            std::array<double, frames> row;
            for (int g = 0; g < F; ++g) row[g] = c_[f][g], gain.from_frame[g] = give * row[g];
            for (int g = 0; g < F; ++g) {
                slope_[g] += row[g] * gain.step;
                v_[g] += row[g] * x;
                w0_[g] += row[g] * t0, w1_[g] += row[g] * t1;
                for (int h = 0; h < F; ++h) c_[g][h] += row[g] * gain.from_frame[h];
            }
        }
    }

    /// Processes the stage `index`: computes its gain and the value function proximal of it. `frame`, `mixed`
    /// and `frame_gains` are the stage's first.
    [[gnu::always_inline]] void step(const RiccatiStage& s, int index, RiccatiGain& gain,
                                     [[maybe_unused]] const FrameStage* frame,
                                     [[maybe_unused]] const double* mixed,
                                     [[maybe_unused]] FrameGain* frame_gains) {
        const Vec3 a = s.length * s.basis.col(0), b = s.length * s.basis.col(1);
        Vec3 y0 = x0_ + times_p(a), y1 = x1_ + times_p(b);
        double q00 = a00_ + s.own(0, 0) - s.axial + a.dot(y0) + x0_.dot(a);
        double q01 = a01_ + s.own(0, 1) + a.dot(y1) + x0_.dot(b);
        double q11 = a11_ + s.own(1, 1) - s.axial + b.dot(y1) + x1_.dot(b);
        double g0 = r0_ + s.slope[0] + a.dot(p_), g1 = r1_ + s.slope[1] + b.dot(p_);
        double c00 = s.cross(0, 0), c01 = s.cross(0, 1), c10 = s.cross(1, 0), c11 = s.cross(1, 1);
        // Parallel transport turns all frames alike: sums over them.
        [[maybe_unused]] std::array<double, frames> z0 = {}, z1 = {}, row = {};
        [[maybe_unused]] double whole = 0, slopes = 0;
        [[maybe_unused]] Vec3 v;
        if constexpr (F > 0) {
            const double h0 = s.twist[0], h1 = s.twist[1], i0 = s.twist_prev[0], i1 = s.twist_prev[1];
            v = v_[0];
            for (int f = 1; f < F; ++f) v += v_[f];
            double n0 = 0, n1 = 0;
            for (int f = 0; f < F; ++f) {
                for (int g = 0; g < F; ++g) row[f] += c_[f][g];
                z0[f] = a.dot(v_[f]) + w0_[f], z1[f] = b.dot(v_[f]) + w1_[f];
                n0 += z0[f], n1 += z1[f];
                whole += row[f];
                slopes += slope_[f];
            }
            q00 += (2 * n0 + whole * h0) * h0;
            q01 += n0 * h1 + (n1 + whole * h1) * h0;
            q11 += (2 * n1 + whole * h1) * h1;
            y0 += h0 * v, y1 += h1 * v;
            n0 += whole * h0, n1 += whole * h1;
            c00 += i0 * n0, c01 += i0 * n1, c10 += i1 * n0, c11 += i1 * n1;
            for (int f = 0; f < F; ++f) {
                z0[f] += row[f] * h0 + frame[f].cross[0];
                z1[f] += row[f] * h1 + frame[f].cross[1];
            }
            g0 += slopes * h0, g1 += slopes * h1;
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
        if constexpr (F > 0) {
            const double i0 = s.twist_prev[0], i1 = s.twist_prev[1];
            x0_ += i0 * v, x1_ += i1 * v;
            a00_ += whole * i0 * i0, a01_ += whole * i0 * i1, a11_ += whole * i1 * i1;
            r0_ += slopes * i0, r1_ += slopes * i1;
            std::array<double, frames> e0, e1;
            for (int f = 0; f < F; ++f) {
                e0[f] = i.a * z0[f] + i.b * z1[f], e1[f] = i.b * z0[f] + i.c * z1[f];
                frame_gains[f].turn = {e0[f], e1[f]};
                w0_[f] = row[f] * i0 + frame[f].cross_prev[0] + c00 * e0[f] + c01 * e1[f];
                w1_[f] = row[f] * i1 + frame[f].cross_prev[1] + c10 * e0[f] + c11 * e1[f];
                v_[f] += e0[f] * y0 + e1[f] * y1;
                slope_[f] += frame[f].slope + z0[f] * t0 + z1[f] * t1;
                c_[f][f] += frame[f].curve + z0[f] * e0[f] + z1[f] * e1[f];
            }
            for (int f = 1; f < F; ++f)
                for (int g = 0; g < f; ++g) {
                    const double by = z0[f] * e0[g] + z1[f] * e1[g] + (mixed ? mixed[f * F + g] : 0.0);
                    c_[f][g] += by;
                    c_[g][f] = c_[f][g];
                }
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
    // Of each frame: cross terms with δx and α, slope, and curvature with every frame.
    std::array<Vec3, frames> v_;
    std::array<double, frames> w0_ = {}, w1_ = {}, slope_ = {};
    std::array<std::array<double, frames>, frames> c_ = {};
    RiccatiReport report_;
};

}  // namespace physics
