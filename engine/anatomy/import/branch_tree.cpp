#include "engine/anatomy/import/branch_tree.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "physics/geometry/polyline.h"

namespace anatomy {

using geometry::CentrelineBranch;
using geometry::Polyline;
using geometry::Vec3;

void BranchTree::add_root(const Polyline& way, bool fixed_start, bool fixed_end) {
    append(-1, -1, recentred(way, wall_, step_, fixed_start, fixed_end));
}

void BranchTree::add(const Own& own, bool fixed_end, BranchSample landing) {
    Polyline way = own.way;
    if (way.size() < 2) way.insert(way.begin(), branches[own.parent.branch].points[own.parent.sample]);
    const double total = geometry::length_of(way);
    clear(way, total);
    if (landing.branch >= 0) {
        std::reverse(way.begin(), way.end());
        clear(way, total);
        std::reverse(way.begin(), way.end());
    }
    Centreline line = recentred(way, wall_, step_, false, fixed_end);
    const int parent_sample = junction(own.parent, line);
    connect(line, branches[own.parent.branch].points[parent_sample]);
    if (landing.branch >= 0) {
        std::reverse(line.points.begin(), line.points.end());
        const int sample = junction(landing, line);
        connect(line, branches[landing.branch].points[sample]);
        std::reverse(line.points.begin(), line.points.end());
        line.radii = inscribed_radii(line.points, wall_);
    }
    append(own.parent.branch, parent_sample, std::move(line));
}

BranchTree::Own BranchTree::own_part(const Polyline& way) const {
    for (std::size_t i = way.size(); i-- > 0;) {
        const BranchSample at = contact(way[i]);
        if (at.branch >= 0) return {at, {way.begin() + static_cast<std::ptrdiff_t>(i) + 1, way.end()}};
    }
    return {{0, 0}, way};
}

double BranchTree::width(const Own& own) const {
    double widest = 0;
    for (const Vec3& p : own.way) widest = std::max(widest, wall_.distance(p));
    return widest;
}

bool BranchTree::is_spur(const Own& own) const {
    if (own.way.size() < 4) return true;
    const CentrelineBranch& parent = branches[own.parent.branch];
    const double length = geometry::length_of(own.way);
    double widest = 0.75 * width(own);
    for (std::size_t i = 0; i < parent.points.size(); ++i)
        if ((parent.points[i] - parent.points[own.parent.sample]).norm() < length)
            widest = std::max(widest, parent.radii[i]);
    return length < 2 * widest;
}

/// The sample of a branch whose ball holds a place (if several do, the one that holds it deepest), or none.
BranchSample BranchTree::contact(const Vec3& x) const {
    BranchSample best;
    double least = 0;
    for (int b = 0; b < static_cast<int>(branches.size()); ++b) {
        const CentrelineBranch& branch = branches[b];
        for (int i = 0; i < static_cast<int>(branch.points.size()); ++i) {
            const double power = (x - branch.points[i]).squaredNorm() - branch.radii[i] * branch.radii[i];
            if (power < least) least = power, best = {b, i};
        }
    }
    return best;
}

/// Drops the start of a path, up to a third of it, as long as its own lumen still opens into others.
void BranchTree::clear(Polyline& way, double total) const {
    double passed = 0;
    std::size_t first = 0;
    while (first + 2 < way.size() && passed < total / 3) {
        const double own = 0.5 * wall_.distance(way[first]);
        bool near = false;
        for (const CentrelineBranch& branch : branches) {
            for (std::size_t i = 0; i < branch.points.size() && !near; ++i)
                near = (way[first] - branch.points[i]).norm() < branch.radii[i] + own;
        }
        if (!near) break;
        passed += (way[first + 1] - way[first]).norm();
        ++first;
    }
    way.erase(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(first));
}

/// The sample of the parent that the line, extended backwards, comes nearest to.
int BranchTree::junction(const BranchSample& at, const Centreline& line) const {
    const CentrelineBranch& parent = branches[at.branch];
    const Vec3 start = line.points.front();
    const std::size_t span = std::min<std::size_t>(line.points.size() - 1, 3);
    const Vec3 back = (start - line.points[span]).normalized();
    const double reach = 3 * (parent.radii[at.sample] + (start - parent.points[at.sample]).norm());
    int best = at.sample;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < static_cast<int>(parent.points.size()); ++i) {
        const Vec3 to = parent.points[i] - start;
        if (to.norm() > reach) continue;
        const double along = std::clamp(to.dot(back), 0.0, reach);
        // A longer way back costs a little, to keep a line parallel to the parent from running down along it.
        const double off = (to - along * back).norm() + 0.1 * along;
        if (off < least) least = off, best = i;
    }
    return best;
}

/// Joins the place to the start of the line by a straight piece.
void BranchTree::connect(Centreline& line, const Vec3& place) const {
    Polyline piece = geometry::resampled({place, line.points.front()}, step_);
    piece.pop_back();
    line.points.insert(line.points.begin(), piece.begin(), piece.end());
    line.radii = inscribed_radii(line.points, wall_);
}

void BranchTree::append(int parent, int parent_sample, Centreline line) {
    branches.push_back({"", parent, parent_sample, std::move(line.points), std::move(line.radii)});
}

void trim_tip(Polyline& way, const geometry::MeshQuery& wall) {
    double passed = 0;
    while (way.size() > 3) {
        if (passed > 1.2 * wall.distance(way.back())) break;
        passed += (way[way.size() - 2] - way.back()).norm();
        way.pop_back();
    }
}

VesselTip tip_of(const std::vector<CentrelineBranch>& branches, int index, const Vec3& apex, bool start) {
    const CentrelineBranch& branch = branches[index];
    const std::size_t last = branch.points.size() - 1, span = std::min<std::size_t>(last, 3);
    const std::size_t at = start ? 0 : last, before = start ? span : last - span;
    return {apex,
            branch.points[at],
            (branch.points[at] - branch.points[before]).normalized(),
            branch.radii[at],
            index,
            start};
}

void sort_stems_first(std::vector<RootedWay>& ways, const geometry::MeshQuery& wall) {
    const auto bulk = [&wall](const Polyline& way) {
        double sum = 0;
        for (std::size_t i = 1; i < way.size(); ++i)
            sum += (way[i] - way[i - 1]).norm() * wall.distance(way[i]);
        return sum;
    };
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < ways.size(); ++i) order.emplace_back(-bulk(ways[i].points), i);
    std::sort(order.begin(), order.end());
    std::vector<RootedWay> sorted;
    for (const auto& [less, i] : order) sorted.push_back(std::move(ways[i]));
    ways = std::move(sorted);
}

}  // namespace anatomy
