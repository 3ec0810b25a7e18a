#include "engine/anatomy/vessel_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace anatomy {

VesselPaths::VesselPaths(const Anatomy& anatomy) {
    const int count = static_cast<int>(anatomy.branches.size());
    for (const CentrelineBranch& branch : anatomy.branches) {
        branches_.push_back({branch.parent, branch.parent_sample, {}});
        for (std::size_t i = 1; i < branch.points.size(); ++i)
            branches_.back().steps.push_back((branch.points[i] - branch.points[i - 1]).norm());
    }
    for (int b = 0; b < count; ++b) {
        const int last = static_cast<int>(anatomy.branches[b].points.size()) - 1;
        if (const auto joint = joint_of(anatomy, b))
            meetings_.insert(meetings_.end(), {{b, last, 0}, *joint});
    }
    if (meetings_.empty()) return;
    for (int b = 0; b < count; ++b) {
        const auto& [parent, sample, steps] = branches_[b];
        if (parent >= 0) meetings_.insert(meetings_.end(), {{b, 0, 0}, {parent, sample, 0}});
    }
    for (std::size_t p = 0; p < meetings_.size(); ++p) {
        const VesselPlace& at = meetings_[p];
        for (std::size_t q = 0; q < p; ++q)
            if (meetings_[q].branch == at.branch)
                stretches_.push_back({p, q, arc_between(at.branch, at.sample, meetings_[q].sample)});
        if (p % 2 == 1) stretches_.push_back({p - 1, p, 0});
    }
}

double VesselPaths::arc_between(int branch, int from, int to) const {
    if (from > to) std::swap(from, to);
    double length = 0;
    for (int i = from; i < to; ++i) length += branches_[branch].steps[i];
    return length;
}

std::optional<double> VesselPaths::between(const VesselPlace& a, const VesselPlace& b) const {
    return meetings_.empty() ? up_the_tree(a, b) : by_loops(a, b);
}

/// Up to the first branch that both ways to the root have in common.
std::optional<double> VesselPaths::up_the_tree(const VesselPlace& a, const VesselPlace& b) const {
    struct Stop {
        int branch, sample;
        double length;  // from the place [mm]
    };
    const auto to_the_root = [&](const VesselPlace& from) {
        std::vector<Stop> stops = {{from.branch, from.sample, 0}};
        for (;;) {
            const Stop& last = stops.back();
            const Branch& branch = branches_[last.branch];
            if (branch.parent < 0) return stops;
            stops.push_back({branch.parent, branch.parent_sample,
                             last.length + arc_between(last.branch, 0, last.sample)});
        }
    };
    const std::vector<Stop> from_a = to_the_root(a), from_b = to_the_root(b);
    for (const Stop& x : from_a)
        for (const Stop& y : from_b)
            if (x.branch == y.branch) return x.length + y.length + arc_between(x.branch, x.sample, y.sample);
    return std::nullopt;
}

/// By all meetings: distances from `a` are lowered until none changes (Bellman and Ford).
std::optional<double> VesselPaths::by_loops(const VesselPlace& a, const VesselPlace& b) const {
    constexpr double unreached = std::numeric_limits<double>::infinity();
    double shortest = a.branch == b.branch ? arc_between(a.branch, a.sample, b.sample) : unreached;
    std::vector<double> length(meetings_.size(), unreached);
    for (std::size_t p = 0; p < meetings_.size(); ++p)
        if (meetings_[p].branch == a.branch) length[p] = arc_between(a.branch, a.sample, meetings_[p].sample);
    for (bool changed = true; changed;) {
        changed = false;
        for (const Stretch& stretch : stretches_) {
            for (const auto& [from, to] :
                 {std::pair(stretch.from, stretch.to), std::pair(stretch.to, stretch.from)}) {
                if (length[from] + stretch.length >= length[to]) continue;
                length[to] = length[from] + stretch.length;
                changed = true;
            }
        }
    }
    for (std::size_t p = 0; p < meetings_.size(); ++p)
        if (meetings_[p].branch == b.branch)
            shortest = std::min(shortest, length[p] + arc_between(b.branch, b.sample, meetings_[p].sample));
    return std::isfinite(shortest) ? std::optional(shortest) : std::nullopt;
}

double centreline_distance(const Anatomy& anatomy, const geometry::Vec3& from, const geometry::Vec3& to) {
    const std::optional<double> length =
        VesselPaths(anatomy).between(nearest_place(anatomy, from), nearest_place(anatomy, to));
    return length.value_or((to - from).norm());
}

}  // namespace anatomy
