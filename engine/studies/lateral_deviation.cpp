#include "engine/studies/lateral_deviation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace studies {
namespace {

using geometry::Vec2;

constexpr int bins = 20;  // of a cycle

}  // namespace

ReferenceCurve::ReferenceCurve(std::span<const geometry::Vec3> joints) {
    assert(joints.size() >= 2);
    for (const geometry::Vec3& x : joints) points_.push_back(x.head<2>());
    for (std::size_t k = 0; k + 1 < points_.size(); ++k) {
        const Vec2 step = points_[k + 1] - points_[k];
        lengths_.push_back(step.norm());
        assert(lengths_.back() > 0);
        along_.push_back(step / lengths_.back());
    }
}

double ReferenceCurve::deviation(const geometry::Vec3& joint) const {
    const Vec2 x = joint.head<2>();
    double least = std::numeric_limits<double>::infinity();
    Vec2 from = Vec2::Zero(), heading = Vec2::Zero();
    for (std::size_t k = 0; k < along_.size(); ++k) {
        const double t = std::clamp((x - points_[k]).dot(along_[k]), 0.0, lengths_[k]);
        const Vec2 off = x - (points_[k] + t * along_[k]);
        if (off.squaredNorm() >= least) continue;
        least = off.squaredNorm();
        from = off;
        heading = along_[k];
        // At a corner the side is that of the mean direction.
        if (t == 0 && k > 0) heading += along_[k - 1];
        if (t == lengths_[k] && k + 1 < along_.size()) heading += along_[k + 1];
    }
    const bool left = heading.x() * from.y() - heading.y() * from.x() > 0;
    return left ? -std::sqrt(least) : std::sqrt(least);
}

DeviationTrace::DeviationTrace(const ReferenceCurve& curve, int joint, int segments)
    : curve_(curve), joint_(joint), per_cycle_(0.5 * segments * (segments + 1.0)) {}

void DeviationTrace::observe(int first_moved, const physics::Chain& wire) {
    const double cycles = static_cast<double>(++updates_) / per_cycle_;
    if (first_moved > joint_) return;
    ++records_;
    const Point now{cycles, curve_.deviation(wire.joints[static_cast<std::size_t>(joint_)])};
    for (int k = 0; k < 3; ++k)
        if (std::abs(now.deviation) > limit_table[k]) exceeded_[k] = cycles;
    const auto bin = static_cast<long long>(static_cast<double>(updates_ - 1) * bins / per_cycle_);
    if (bins_.empty()) start_ = now.deviation;
    if (bins_.empty() || bins_.back().first != bin) bins_.push_back({bin, {now, now, now}});
    Extremes& extremes = bins_.back().second;
    if (now.deviation < extremes.least.deviation) extremes.least = now;
    if (now.deviation > extremes.largest.deviation) extremes.largest = now;
    extremes.last = now;
    extremes.sum += std::abs(now.deviation);
    ++extremes.records;
}

double DeviationTrace::settled(double limit) const {
    const auto k = std::find(std::begin(limit_table), std::end(limit_table), limit) - std::begin(limit_table);
    assert(k < 3);
    const double end = bins_.empty() ? 0 : static_cast<double>(bins_.back().first + 1) / bins;
    // It must stay within the limit for a whole cycle at least, or it may just be passing.
    return exceeded_[k] > end - 1 ? std::numeric_limits<double>::infinity() : exceeded_[k];
}

double DeviationTrace::swing(int cycle) const {
    double least = std::numeric_limits<double>::infinity(), largest = -least;
    for (const auto& [bin, extremes] : bins_) {
        if (bin / bins != cycle) continue;
        least = std::min(least, extremes.least.deviation);
        largest = std::max(largest, extremes.largest.deviation);
    }
    return std::max(0.0, largest - least);
}

double DeviationTrace::left_after(int cycle) const {
    double last = start_;
    for (const auto& [bin, extremes] : bins_)
        if (bin / bins <= cycle) last = extremes.last.deviation;
    return std::abs(last / start_);
}

double DeviationTrace::mean(int cycles) const {
    double sum = 0;
    long long records = 0;
    for (const auto& [bin, extremes] : bins_) {
        if (bin / bins >= cycles) continue;
        sum += extremes.sum;
        records += extremes.records;
    }
    return records > 0 ? sum / static_cast<double>(records) : 0.0;
}

std::vector<DeviationTrace::Point> DeviationTrace::points() const {
    std::vector<Point> points;
    for (const auto& [bin, extremes] : bins_) {
        const bool falls = extremes.largest.cycles < extremes.least.cycles;
        points.push_back(falls ? extremes.largest : extremes.least);
        if (extremes.least.cycles != extremes.largest.cycles)
            points.push_back(falls ? extremes.least : extremes.largest);
    }
    return points;
}

physics::RelaxReport follow(const physics::RelaxerConfig& config, physics::Chain& wire,
                            const physics::LumenWall& wall, int cycles, std::span<DeviationTrace> traces) {
    return physics::make_relaxer(config, wall)
        ->relax(wire, physics::whole_cycles(wire.segments(), cycles),
                [&](int first, const physics::Chain& now) {
                    for (DeviationTrace& trace : traces) trace.observe(first, now);
                });
}

}  // namespace studies
