#include "physics/geometry/centreline_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/geometry/polyline.h"

namespace geometry {

double OpenEnd::beyond(const Vec3& x, double margin) const {
    const Vec3 d = x - centre;
    const double out = d.dot(outward_normal);
    const double reach = 2 * radius + margin;
    if (out <= 0 || out >= 4 * radius + margin) return 0;
    return (d - out * outward_normal).squaredNorm() < reach * reach ? out : 0;
}

namespace {

/// Distance of a point from the lumen that a branch's inscribed balls make up, negative inside [mm].
double outside(const CentrelineBranch& branch, const Vec3& x) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < branch.points.size(); ++i)
        least = std::min(least, (x - branch.points[i]).norm() - branch.radii[i]);
    return least;
}

}  // namespace

int joined_branch(std::span<const CentrelineBranch> branches, std::span<const OpenEnd> ends, int branch) {
    const CentrelineBranch& own = branches[branch];
    const Vec3& last = own.points.back();
    for (const OpenEnd& end : ends)
        if ((last - end.centre).norm() < 2 * end.radius) return -1;
    for (const CentrelineBranch& other : branches)
        if (other.parent == branch && goes_on_in(own, other)) return -1;
    int joined = -1;
    double least = 0;
    for (int b = 0; b < static_cast<int>(branches.size()); ++b) {
        if (b == branch) continue;
        const double distance = outside(branches[b], last);
        if (distance >= least) continue;
        const bool left =
            b != own.parent || std::any_of(own.points.begin(), own.points.end(),
                                           [&](const Vec3& p) { return outside(branches[b], p) > 0; });
        if (left) least = distance, joined = b;
    }
    return joined;
}

CentrelineTree::CentrelineTree(std::span<const CentrelineBranch> branches, std::vector<OpenEnd> ends)
    : ends_(std::move(ends)) {
    std::vector<int> first;
    for (std::size_t b = 0; b < branches.size(); ++b) {
        const CentrelineBranch& branch = branches[b];
        if (branch.points.size() < 2 || branch.radii.size() != branch.points.size())
            throw std::invalid_argument("branch '" + branch.name +
                                        "' needs two points or more, a radius for each");
        first.push_back(static_cast<int>(stations_.size()));
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            if (!branch.points[i].allFinite() || !std::isfinite(branch.radii[i]) || branch.radii[i] <= 0)
                throw std::invalid_argument("branch '" + branch.name + "', sample " + std::to_string(i) +
                                            ": the point must be finite and the radius positive");
            stations_.push_back(
                {branch.points[i], branch.radii[i], static_cast<int>(b), static_cast<int>(i)});
        }
    }
    if (stations_.empty()) throw std::invalid_argument("the lumen has no centreline");
    for (const Station& station : stations_) centres_.push_back(station.centre);
    for (std::size_t b = 0; b < branches.size(); ++b) {
        // Parents come first; the check that they exist is below.
        const CentrelineBranch& branch = branches[b];
        const bool child = branch.parent >= 0 && branch.parent < static_cast<int>(b);
        const double start =
            child ? arc_lengths_[first[branch.parent] + std::max(0, branch.parent_sample)] : 0.0;
        first_of_branch_.push_back(first[b]);
        const std::vector<double> own = arc_lengths(branch.points, start);
        arc_lengths_.insert(arc_lengths_.end(), own.begin(), own.end());
    }
    first_of_branch_.push_back(static_cast<int>(stations_.size()));

    neighbours_.resize(stations_.size());
    auto link = [&](int a, int b) {
        if (std::find(neighbours_[a].begin(), neighbours_[a].end(), b) == neighbours_[a].end()) {
            neighbours_[a].push_back(b);
            neighbours_[b].push_back(a);
        }
    };
    for (std::size_t s = 0; s + 1 < stations_.size(); ++s)
        if (stations_[s].branch == stations_[s + 1].branch) link(s, s + 1);
    // Links a station to those of another branch around it; false where the two do not overlap.
    const auto link_across = [&](int station, int other) {
        const int p0 = first[other], p1 = p0 + static_cast<int>(branches[other].points.size());
        const Vec3& centre = stations_[station].centre;
        int nearest = p0;
        for (int p = p0; p < p1; ++p)
            if (stations_[p].power(centre) < stations_[nearest].power(centre)) nearest = p;
        const double gap = (stations_[nearest].centre - centre).norm() - stations_[nearest].radius -
                           stations_[station].radius;
        if (gap > 0) return false;
        // All that overlap it: between two vessels at a sharp angle the way across is not the shortest.
        for (int p = p0; p < p1; ++p) {
            const double reach = stations_[p].radius + stations_[station].radius;
            if (std::abs(p - nearest) <= 3 || (stations_[p].centre - centre).squaredNorm() < reach * reach)
                link(station, p);
        }
        return true;
    };
    // A child lies inside its parent for its first samples: there each links to the parent's stations around
    // it, so that a joint finds its way through the ostium in both directions.
    for (std::size_t b = 0; b < branches.size(); ++b) {
        const int parent = branches[b].parent, count = static_cast<int>(branches[b].points.size());
        if (parent >= static_cast<int>(branches.size()))
            throw std::invalid_argument("branch '" + branches[b].name + "' has a parent that does not exist");
        for (int i = 0; parent >= 0 && i < count && link_across(first[b] + i, parent);) ++i;
        // The same at the other end of a branch that closes a loop.
        const int joined = joined_branch(branches, ends_, static_cast<int>(b));
        for (int i = count - 1; joined >= 0 && i >= 0 && link_across(first[b] + i, joined);) --i;
    }
    ends_at_.resize(stations_.size());
    for (std::size_t e = 0; e < ends_.size(); ++e) {
        const int branch = stations_[locate(ends_[e].centre, -1)].branch;
        for (int s = first_of_branch_[branch]; s < first_of_branch_[branch + 1]; ++s)
            if ((centres_[s] - ends_[e].centre).norm() <= 2 * ends_[e].radius)
                ends_at_[s].push_back(static_cast<int>(e));
    }
}

int CentrelineTree::locate(const Vec3& x, int hint) const {
    const int count = static_cast<int>(stations_.size());
    if (hint < 0 || hint >= count) {
        int best = 0;
        double least = stations_[0].power(x);
        for (int s = 1; s < count; ++s)
            if (const double p = stations_[s].power(x); p < least) least = p, best = s;
        return best;
    }
    return downhill(x, hint, [](int) { return true; });
}

template <class Allowed>
int CentrelineTree::downhill(const Vec3& x, int hint, const Allowed& allowed) const {
    int best = hint;
    double least = stations_[best].power(x);
    for (bool moved = true; moved;) {
        moved = false;
        const int from = best;
        for (int s : neighbours_[from]) {
            if (!allowed(s)) continue;
            if (const double p = stations_[s].power(x); p < least) least = p, best = s, moved = true;
        }
    }
    return best;
}

int CentrelineTree::locate_within(const Vec3& x, int hint, std::span<const int> group_of) const {
    const int free = locate(x, hint);
    if (hint < 0 || hint >= static_cast<int>(stations_.size()) || group_of[free] == group_of[hint])
        return free;
    const int own = downhill(x, hint, [&](int s) { return group_of[s] == group_of[hint]; });
    // The power grows by about twice the radius times the way past the border.
    constexpr double quarter_way = 0.5;
    const double radius = stations_[free].radius;
    return stations_[own].power(x) <= stations_[free].power(x) + quarter_way * radius * radius ? own : free;
}

bool CentrelineTree::same_branch(int station, int other) const {
    const int count = static_cast<int>(stations_.size());
    return station >= 0 && other >= 0 && station < count && other < count &&
           stations_[station].branch == stations_[other].branch;
}

double CentrelineTree::longest_arc() const {
    return *std::max_element(arc_lengths_.begin(), arc_lengths_.end());
}

CentrelineCoordinate CentrelineTree::coordinate(int station, const Vec3& x) const {
    const int branch = stations_[station].branch, first = first_of_branch_[branch];
    const auto count = static_cast<std::size_t>(first_of_branch_[branch + 1] - first);
    return centreline_coordinate(std::span(centres_).subspan(first, count),
                                 std::span(arc_lengths_).subspan(first, count), station - first, x);
}

bool CentrelineTree::beyond_an_end(const Vec3& x) const {
    return std::any_of(ends_.begin(), ends_.end(), [&](const OpenEnd& end) { return end.beyond(x) > 0; });
}

Vec3 CentrelineTree::closest_point(int s, const Vec3& x) const {
    Vec3 best = stations_[s].centre;
    double least = (x - best).squaredNorm();
    for (int other : {s - 1, s + 1}) {
        if (other < 0 || other >= static_cast<int>(stations_.size())) continue;
        if (stations_[other].branch != stations_[s].branch) continue;
        const Vec3 a = stations_[s].centre, b = stations_[other].centre;
        if ((b - a).squaredNorm() == 0) continue;
        const Vec3 c = a + closest_fraction(a, b, x) * (b - a);
        if (const double d = (x - c).squaredNorm(); d < least) least = d, best = c;
    }
    return best;
}

}  // namespace geometry
