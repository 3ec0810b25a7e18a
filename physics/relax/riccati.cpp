#include "physics/relax/riccati.h"

#include <algorithm>
#include <cmath>

#include "physics/geometry/maths.h"
#include "physics/relax/riccati_recursion.h"

namespace physics {
namespace {

constexpr double seen_pivot = 1e-12;  // of a block: an eigenvalue below this fraction is rounding

struct Pivot {
    double least;    // lower eigenvalue
    Vec2 direction;  // its unit eigenvector
};

Pivot lower_eigenpair(double a, double b, double c) {  // of [a b; b c]
    const double mean = 0.5 * (a + c), half = 0.5 * (a - c), root = geometry::hypot(half, b);
    Pivot p{mean - root, Vec2::UnitX()};
    assert(!(p.least > std::min(a, c) + 1e-9 * (std::abs(a) + std::abs(c))));
    const Vec2 direction(b, p.least - a);
    const Vec2 other(p.least - c, b);
    const Vec2& longer = direction.squaredNorm() > other.squaredNorm() ? direction : other;
    if (longer.squaredNorm() > 0) p.direction = longer.normalized();
    return p;
}

/// Whether a frame twists segment by segment.
bool twists(const FrameStages& frames) {
    for (int f = 0; f < frames.count; ++f)
        if (!frames.stages.empty() && frames.stages[f].twist_stiffness > 0) return true;
    return false;
}

/// One stage after the other, from the tip.
template <int F>
class Backward {
public:
    Backward(std::span<const RiccatiStage> stages, std::span<RiccatiGain> gains, const FrameStages& frames,
             double mu, double least_pivot)
        : recursion(mu, least_pivot),
          stages_(stages),
          gains_(gains),
          frames_(frames),
          twists_(twists(frames)) {
        assert(gains.size() == stages.size() && frames.count == F);
        assert(frames.stages.size() == stages.size() * F && frames.gains.size() == stages.size() * F);
    }

    void step(int j, std::span<const FedStage> fed = {}) {
        assert(j >= 0 && j < static_cast<int>(stages_.size()));
        const FrameStage* frame = F > 0 ? &frames_.stages[j * F] : nullptr;
        FrameGain* gains = F > 0 ? &frames_.gains[j * F] : nullptr;
        recursion.add_wall(stages_[j]);
        if (F > 0 && twists_) recursion.twist_segment(stages_[j], j, frame, gains);
        for (const FedStage& f : fed)
            if (f.stage == j) recursion.feed(f.by);
        recursion.step(stages_[j], j, gains_[j], frame,
                       frames_.mixed.empty() ? nullptr : &frames_.mixed[j * F * F], gains);
    }

    RiccatiRecursion<F> recursion;

private:
    std::span<const RiccatiStage> stages_;
    std::span<RiccatiGain> gains_;
    const FrameStages& frames_;
    bool twists_;
};

template <int F>
FrameVector answer(std::span<const RiccatiStage> stages, int first, double mu, bool anew, double least_pivot,
                   std::span<RiccatiGain> gains, const FrameStages& frames, std::span<const FedStage> fed) {
    int last = static_cast<int>(stages.size());  // most proximal fed stage
    assert(first >= 0 && first < last && mu >= 0);
    for (const FedStage& f : fed)
        if (f.stage >= 0) last = std::min(last, f.stage);
    if (anew) last = first;
    Backward<F> pass(stages, gains, frames, mu, least_pivot);
    int j = static_cast<int>(stages.size()) - 1;
    for (; j >= last; --j) pass.step(j, fed);
    // Proximal of it no curvature changes: linear terms alone.
    Vec3 p = pass.recursion.slope_x();
    Vec2 r = pass.recursion.slope_turn();
    FrameVector slope = {};
    for (int f = 0; f < F; ++f) slope[f] = pass.recursion.slopes()[f];
    for (; j >= first; --j) {
        const RiccatiStage& s = stages[j];
        RiccatiGain& gain = gains[j];
        if (s.touches) p += s.force;
        double slopes = 0;
        for (int f = 0; f < F; ++f) {
            const FrameStage& t = frames.stages[j * F + f];
            if (t.twist_stiffness > 0) slope[f] += t.grip_slope;
        }
        for (int f = 0; f < F; ++f) {
            const FrameStage& t = frames.stages[j * F + f];
            if (t.twist_stiffness == 0) continue;
            FrameGain& own = frames.gains[j * F + f];
            const double by = slope[f] + t.twist_slope;
            assert(own.give <= 0);
            own.step = own.give * by;
            p += by * own.from_x;
            r += by * own.from_turn;
            for (int g = 0; g < F; ++g) slope[g] += by * own.from_frame[g];
        }
        for (int f = 0; f < F; ++f) slopes += slope[f];
        Vec2 g = r + s.slope + s.length * (s.basis.transpose() * p);
        if constexpr (F > 0) g += slopes * s.twist;
        const SymmetricBlock& i = gain.inverse;
        gain.step = {i.a * g[0] + i.b * g[1], i.b * g[0] + i.c * g[1]};
        p.noalias() += gain.from_x.transpose() * g;
        r = s.slope_prev;
        r.noalias() += gain.from_prev.transpose() * g;
        if constexpr (F > 0) r += slopes * s.twist_prev;
        for (int f = 0; f < F; ++f)
            slope[f] += frames.stages[j * F + f].slope + frames.gains[j * F + f].turn.dot(g);
    }
    return slope;
}

}  // namespace

SymmetricBlock minus_mirrored_inverse(double q00, double q01, double q11, double least_pivot, int stage,
                                      RiccatiReport& report) {
    const Pivot pivot = lower_eigenpair(q00, q01, q11);
    if (report.shifted++ == 0) {
        report.stage = stage;
        report.frame = -1;
        report.direction = pivot.direction;
    }
    // Where the block is large, what cancels in its eigenvalue is rounding. A floor that does not grow with
    // the block would let the value function grow by a square at each such stage, until it overflows.
    const double floor = std::max(least_pivot, seen_pivot * (std::abs(q00) + std::abs(q11)));
    const double low = -1 / std::max(floor, std::abs(pivot.least));
    const double high = -1 / std::max(floor, std::abs(q00 + q11 - pivot.least));
    assert(low <= 0 && high <= 0);
    const Vec2& direction = pivot.direction;
    return {high + (low - high) * direction[0] * direction[0], (low - high) * direction[0] * direction[1],
            high + (low - high) * direction[1] * direction[1]};
}

RiccatiReport riccati_backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                               std::span<RiccatiGain> gains, const FrameStages& frames) {
    assert(mu >= 0 && least_pivot >= 0);
    return with_frames(frames.count, [&](auto count) {
        Backward<count()> pass(stages, gains, frames, mu, least_pivot);
        for (int j = static_cast<int>(stages.size()) - 1; j >= 0; --j) pass.step(j);
        return pass.recursion.report();
    });
}

FrameVector riccati_answer(std::span<const RiccatiStage> stages, int first, double mu, bool anew,
                           double least_pivot, std::span<RiccatiGain> gains, const FrameStages& frames,
                           std::span<const FedStage> fed) {
    return with_frames(frames.count, [&](auto count) {
        return answer<count()>(stages, first, mu, anew, least_pivot, gains, frames, fed);
    });
}

}  // namespace physics
