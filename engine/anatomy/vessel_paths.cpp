#include "engine/anatomy/vessel_paths.h"

#include <algorithm>
#include <cassert>
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
    const std::vector<Piece> pieces = route(a, b);
    if (pieces.empty()) return std::nullopt;
    double length = 0;
    for (const Piece& piece : pieces) length += arc_between(piece.branch, piece.from, piece.to);
    return length;
}

std::vector<VesselPaths::Piece> VesselPaths::route(const VesselPlace& a, const VesselPlace& b) const {
    return meetings_.empty() ? up_the_tree(a, b) : by_loops(a, b);
}

/// Up to the first branch that both ways to the root have in common.
std::vector<VesselPaths::Piece> VesselPaths::up_the_tree(const VesselPlace& a, const VesselPlace& b) const {
    const auto to_the_root = [&](const VesselPlace& from) {
        std::vector<VesselPlace> stops = {{from.branch, from.sample, 0}};
        for (int at = from.branch; branches_[at].parent >= 0; at = branches_[at].parent)
            stops.push_back({branches_[at].parent, branches_[at].parent_sample, 0});
        return stops;
    };
    const std::vector<VesselPlace> from_a = to_the_root(a), from_b = to_the_root(b);
    for (std::size_t x = 0; x < from_a.size(); ++x)
        for (std::size_t y = 0; y < from_b.size(); ++y) {
            if (from_a[x].branch != from_b[y].branch) continue;
            std::vector<Piece> pieces;
            for (std::size_t k = 0; k < x; ++k) pieces.push_back({from_a[k].branch, from_a[k].sample, 0});
            pieces.push_back({from_a[x].branch, from_a[x].sample, from_b[y].sample});
            for (std::size_t k = y; k-- > 0;) pieces.push_back({from_b[k].branch, 0, from_b[k].sample});
            return pieces;
        }
    return {};
}

/// By all meetings: distances from `a` are lowered until none changes (Bellman and Ford).
std::vector<VesselPaths::Piece> VesselPaths::by_loops(const VesselPlace& a, const VesselPlace& b) const {
    constexpr double unreached = std::numeric_limits<double>::infinity();
    constexpr std::size_t start = std::numeric_limits<std::size_t>::max();
    std::vector<double> length(meetings_.size(), unreached);
    std::vector<std::size_t> before(meetings_.size(), start);
    for (std::size_t p = 0; p < meetings_.size(); ++p)
        if (meetings_[p].branch == a.branch) length[p] = arc_between(a.branch, a.sample, meetings_[p].sample);
    for (bool changed = true; changed;) {
        changed = false;
        for (const Stretch& stretch : stretches_) {
            for (const auto& [from, to] :
                 {std::pair(stretch.from, stretch.to), std::pair(stretch.to, stretch.from)}) {
                if (length[from] + stretch.length >= length[to]) continue;
                length[to] = length[from] + stretch.length;
                before[to] = from;
                changed = true;
            }
        }
    }
    double shortest = a.branch == b.branch ? arc_between(a.branch, a.sample, b.sample) : unreached;
    std::size_t last = start;  // meeting from which the target is reached
    for (std::size_t p = 0; p < meetings_.size(); ++p) {
        if (meetings_[p].branch != b.branch) continue;
        const double by = length[p] + arc_between(b.branch, b.sample, meetings_[p].sample);
        if (by < shortest) shortest = by, last = p;
    }
    if (!std::isfinite(shortest)) return {};
    if (last == start) return {{a.branch, a.sample, b.sample}};
    std::vector<Piece> pieces = {{b.branch, meetings_[last].sample, b.sample}};
    for (std::size_t p = last; before[p] != start; p = before[p]) {
        const VesselPlace &from = meetings_[before[p]], &to = meetings_[p];
        if (from.branch == to.branch && from.sample != to.sample)
            pieces.push_back({from.branch, from.sample, to.sample});
        last = before[p];
    }
    pieces.push_back({a.branch, a.sample, meetings_[last].sample});
    std::reverse(pieces.begin(), pieces.end());
    return pieces;
}

double centreline_distance(const Anatomy& anatomy, const geometry::Vec3& from, const geometry::Vec3& to) {
    const std::optional<double> length =
        VesselPaths(anatomy).between(nearest_place(anatomy, from), nearest_place(anatomy, to));
    return length.value_or((to - from).norm());
}

void points_on(const Anatomy& anatomy, const std::vector<VesselPaths::Piece>& route, double spacing,
               std::vector<geometry::Vec3>& points) {
    assert(spacing > 0 && !route.empty());
    const auto at = [&](int branch, int sample) -> const geometry::Vec3& {
        return anatomy.branches[static_cast<std::size_t>(branch)].points[static_cast<std::size_t>(sample)];
    };
    std::size_t found = 0;
    double to_go = spacing;
    geometry::Vec3 x = at(route.front().branch, route.front().from);
    const auto go_to = [&](const geometry::Vec3& next) {
        for (double step; found < points.size() && (step = (next - x).norm()) >= to_go; to_go = spacing) {
            x += to_go / step * (next - x);
            points[found++] = x;
        }
        to_go -= (next - x).norm();
        x = next;
    };
    for (const VesselPaths::Piece& piece : route) {
        const int by = piece.from <= piece.to ? 1 : -1;
        for (int sample = piece.from; found < points.size(); sample += by) {
            go_to(at(piece.branch, sample));
            if (sample == piece.to) break;
        }
    }
    std::fill(points.begin() + static_cast<std::ptrdiff_t>(found), points.end(), x);
}

}  // namespace anatomy
