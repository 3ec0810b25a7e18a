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
        Stage t = of_turns(s);
        if constexpr (F > 0) add_frames(s, frame, t);
        const double det = t.q00 * t.q11 - t.q01 * t.q01;
        if (t.q00 > 0 && det > 0) {
            const double scale = -1 / det;
            gain.inverse = {t.q11 * scale, -t.q01 * scale, t.q00 * scale};
        } else {
            gain.inverse = minus_mirrored_inverse(t.q00, t.q01, t.q11, least_pivot_, index, report_);
        }
        eliminate(s, t, gain);
        if constexpr (F > 0) eliminate_frames(s, frame, mixed, t, gain, frame_gains);
    }

private:
    /// What the value function and a stage make of its two turns: Q, Y by columns, g, X with the frames'
    /// share, and of each frame its cross terms z with the turns.
    struct Stage {
        Vec3 y0, y1;
        double q00, q01, q11, g0, g1, c00, c01, c10, c11;
        // Parallel transport turns all frames alike: sums over them.
        std::array<double, frames> z0 = {}, z1 = {}, row = {};
        double whole = 0, slopes = 0;
        Vec3 v, a, b;
    };

    [[gnu::always_inline]] Stage of_turns(const RiccatiStage& s) const {
        Stage t;
        t.a = s.length * s.basis.col(0), t.b = s.length * s.basis.col(1);
        const Vec3 &a = t.a, &b = t.b;
        t.y0 = x0_ + times_p(a), t.y1 = x1_ + times_p(b);
        t.q00 = a00_ + s.own(0, 0) - s.axial + a.dot(t.y0) + x0_.dot(a);
        t.q01 = a01_ + s.own(0, 1) + a.dot(t.y1) + x0_.dot(b);
        t.q11 = a11_ + s.own(1, 1) - s.axial + b.dot(t.y1) + x1_.dot(b);
        t.g0 = r0_ + s.slope[0] + a.dot(p_), t.g1 = r1_ + s.slope[1] + b.dot(p_);
        t.c00 = s.cross(0, 0), t.c01 = s.cross(0, 1), t.c10 = s.cross(1, 0), t.c11 = s.cross(1, 1);
        return t;
    }

    /// The turns that the stage's transport gives the frames.
    [[gnu::always_inline]] void add_frames(const RiccatiStage& s, const FrameStage* frame, Stage& t) const {
        const double h0 = s.twist[0], h1 = s.twist[1], i0 = s.twist_prev[0], i1 = s.twist_prev[1];
        t.v = v_[0];
        for (int f = 1; f < F; ++f) t.v += v_[f];
        double n0 = 0, n1 = 0;
        for (int f = 0; f < F; ++f) {
            for (int g = 0; g < F; ++g) t.row[f] += c_[f][g];
            t.z0[f] = t.a.dot(v_[f]) + w0_[f], t.z1[f] = t.b.dot(v_[f]) + w1_[f];
            n0 += t.z0[f], n1 += t.z1[f];
            t.whole += t.row[f];
            t.slopes += slope_[f];
        }
        t.q00 += (2 * n0 + t.whole * h0) * h0;
        t.q01 += n0 * h1 + (n1 + t.whole * h1) * h0;
        t.q11 += (2 * n1 + t.whole * h1) * h1;
        t.y0 += h0 * t.v, t.y1 += h1 * t.v;
        n0 += t.whole * h0, n1 += t.whole * h1;
        t.c00 += i0 * n0, t.c01 += i0 * n1, t.c10 += i1 * n0, t.c11 += i1 * n1;
        for (int f = 0; f < F; ++f) {
            t.z0[f] += t.row[f] * h0 + frame[f].cross[0];
            t.z1[f] += t.row[f] * h1 + frame[f].cross[1];
        }
        t.g0 += t.slopes * h0, t.g1 += t.slopes * h1;
    }

    /// The turns' gains, and what is left of the value function.
    [[gnu::always_inline]] void eliminate(const RiccatiStage& s, const Stage& t, RiccatiGain& gain) {
        const SymmetricBlock& i = gain.inverse;
        const double t0 = i.a * t.g0 + i.b * t.g1, t1 = i.b * t.g0 + i.c * t.g1;
        gain.step = {t0, t1};
        const Vec3 &y0 = t.y0, &y1 = t.y1, f0 = i.a * y0 + i.b * y1, f1 = i.b * y0 + i.c * y1;
        gain.from_x.row(0) = f0, gain.from_x.row(1) = f1;
        const double v00 = i.a * t.c00 + i.b * t.c01, v01 = i.a * t.c10 + i.b * t.c11;
        const double v10 = i.b * t.c00 + i.c * t.c01, v11 = i.b * t.c10 + i.c * t.c11;
        gain.from_prev << v00, v01, v10, v11;
        p00_ += y0[0] * f0[0] + y1[0] * f1[0], p01_ += y0[0] * f0[1] + y1[0] * f1[1];
        p02_ += y0[0] * f0[2] + y1[0] * f1[2], p11_ += y0[1] * f0[1] + y1[1] * f1[1];
        p12_ += y0[1] * f0[2] + y1[1] * f1[2], p22_ += y0[2] * f0[2] + y1[2] * f1[2];
        p_ += t0 * y0 + t1 * y1;
        x0_ = v00 * y0 + v10 * y1;
        x1_ = v01 * y0 + v11 * y1;
        a00_ = s.prev_prev(0, 0) + t.c00 * v00 + t.c01 * v10;
        a01_ = s.prev_prev(0, 1) + t.c00 * v01 + t.c01 * v11;
        a11_ = s.prev_prev(1, 1) + t.c10 * v01 + t.c11 * v11;
        r0_ = s.slope_prev[0] + t.c00 * t0 + t.c01 * t1;
        r1_ = s.slope_prev[1] + t.c10 * t0 + t.c11 * t1;
    }

    /// The same of the frames, whose turns the turns' gains answer.
    [[gnu::always_inline]] void eliminate_frames(const RiccatiStage& s, const FrameStage* frame,
                                                 const double* mixed, const Stage& t, const RiccatiGain& gain,
                                                 FrameGain* frame_gains) {
        const SymmetricBlock& i = gain.inverse;
        const double i0 = s.twist_prev[0], i1 = s.twist_prev[1], t0 = gain.step[0], t1 = gain.step[1];
        x0_ += i0 * t.v, x1_ += i1 * t.v;
        a00_ += t.whole * i0 * i0, a01_ += t.whole * i0 * i1, a11_ += t.whole * i1 * i1;
        r0_ += t.slopes * i0, r1_ += t.slopes * i1;
        std::array<double, frames> e0, e1;
        for (int f = 0; f < F; ++f) {
            e0[f] = i.a * t.z0[f] + i.b * t.z1[f], e1[f] = i.b * t.z0[f] + i.c * t.z1[f];
            frame_gains[f].turn = {e0[f], e1[f]};
            w0_[f] = t.row[f] * i0 + frame[f].cross_prev[0] + t.c00 * e0[f] + t.c01 * e1[f];
            w1_[f] = t.row[f] * i1 + frame[f].cross_prev[1] + t.c10 * e0[f] + t.c11 * e1[f];
            v_[f] += e0[f] * t.y0 + e1[f] * t.y1;
            slope_[f] += frame[f].slope + t.z0[f] * t0 + t.z1[f] * t1;
            c_[f][f] += frame[f].curve + t.z0[f] * e0[f] + t.z1[f] * e1[f];
        }
        for (int f = 1; f < F; ++f)
            for (int g = 0; g < f; ++g) {
                c_[f][g] += t.z0[f] * e0[g] + t.z1[f] * e1[g] + (mixed ? mixed[f * F + g] : 0.0);
                c_[g][f] = c_[f][g];
            }
    }

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
