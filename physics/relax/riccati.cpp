#include "physics/relax/riccati.h"

#include <algorithm>
#include <cmath>

#include "physics/relax/riccati_recursion.h"

namespace physics {
namespace {

constexpr double seen_pivot = 1e-12;  // of a block: an eigenvalue below this share is rounding

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

template <Twist twist>
RiccatiReport backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                       std::span<RiccatiGain> gains, [[maybe_unused]] const SegmentTwists& twists = {}) {
    RiccatiRecursion<twist> recursion(mu, least_pivot);
    for (int j = static_cast<int>(stages.size()) - 1; j >= 0; --j) {
        recursion.add_wall(stages[j]);
        if constexpr (twist == Twist::Each)
            recursion.twist_segment(stages[j], twists.stages[j], j, twists.gains[j]);
        recursion.step(stages[j], j, gains[j]);
    }
    return recursion.report();
}

template <Twist twist>
double answer(std::span<const RiccatiStage> stages, int first, double mu, bool anew, double least_pivot,
              std::span<RiccatiGain> gains, std::span<const FedStage> fed) {
    constexpr bool with_twist = twist != Twist::None;
    int last = static_cast<int>(stages.size());  // most proximal fed stage
    for (const FedStage& f : fed)
        if (f.stage >= 0) last = std::min(last, f.stage);
    if (anew) last = first;
    RiccatiRecursion<twist> recursion(mu, least_pivot);
    int j = static_cast<int>(stages.size()) - 1;
    for (; j >= last; --j) {
        recursion.add_wall(stages[j]);
        for (const FedStage& f : fed)
            if (f.stage == j) recursion.feed(f.by);
        recursion.step(stages[j], j, gains[j]);
    }
    // Proximal of it no curvature changes: linear terms alone.
    Vec3 p = recursion.slope_x();
    Vec2 r = recursion.slope_turn();
    [[maybe_unused]] double slope_twist = recursion.slope_twist();
    for (; j >= first; --j) {
        const RiccatiStage& s = stages[j];
        RiccatiGain& gain = gains[j];
        if (s.touches) p += s.force;
        Vec2 g = r + s.slope + s.length * (s.basis.transpose() * p);
        if constexpr (with_twist) g += slope_twist * s.twist;
        const SymmetricBlock& i = gain.inverse;
        gain.step = {i.a * g[0] + i.b * g[1], i.b * g[0] + i.c * g[1]};
        p.noalias() += gain.from_x.transpose() * g;
        r = s.slope_prev;
        r.noalias() += gain.from_prev.transpose() * g;
        if constexpr (with_twist) {
            r += slope_twist * s.twist_prev;
            slope_twist += s.slope_twist + gain.from_twist.dot(g);
        }
    }
    return slope_twist;
}

}  // namespace

SymmetricBlock minus_mirrored_inverse(double q00, double q01, double q11, double least_pivot, int stage,
                                      RiccatiReport& report) {
    const Pivot pivot = lower_eigenpair(q00, q01, q11);
    if (report.shifted++ == 0) {
        report.stage = stage;
        report.way = pivot.way;
    }
    // Where the block is large, what cancels in its eigenvalue is rounding. A floor that does not grow with
    // the block would let the value function grow by a square at each such stage, until it overflows.
    const double floor = std::max(least_pivot, seen_pivot * (std::abs(q00) + std::abs(q11)));
    const double low = -1 / std::max(floor, std::abs(pivot.least));
    const double high = -1 / std::max(floor, std::abs(q00 + q11 - pivot.least));
    const Vec2& way = pivot.way;
    return {high + (low - high) * way[0] * way[0], (low - high) * way[0] * way[1],
            high + (low - high) * way[1] * way[1]};
}

RiccatiReport riccati_backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                               Twist twist, std::span<RiccatiGain> gains, const SegmentTwists& twists) {
    switch (twist) {
        case Twist::One:
            return backward<Twist::One>(stages, mu, least_pivot, gains);
        case Twist::Two:
            return backward<Twist::Two>(stages, mu, least_pivot, gains);
        case Twist::Each:
            return backward<Twist::Each>(stages, mu, least_pivot, gains, twists);
        case Twist::None:
            break;
    }
    return backward<Twist::None>(stages, mu, least_pivot, gains);
}

double riccati_answer(std::span<const RiccatiStage> stages, int first, double mu, bool anew,
                      double least_pivot, Twist twist, std::span<RiccatiGain> gains,
                      std::span<const FedStage> fed) {
    return twist == Twist::None ? answer<Twist::None>(stages, first, mu, anew, least_pivot, gains, fed)
                                : answer<Twist::One>(stages, first, mu, anew, least_pivot, gains, fed);
}

}  // namespace physics
