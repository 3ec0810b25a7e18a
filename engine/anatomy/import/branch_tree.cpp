#include "engine/anatomy/import/branch_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "physics/geometry/maths.h"
#include "physics/geometry/polyline.h"

namespace anatomy {

using geometry::CentrelineBranch;
using geometry::Polyline;
using geometry::Vec3;

void BranchTree::add_root(const Polyline& path, bool fixed_start, bool fixed_end) {
    append(-1, -1, recentred(path, wall_, step_, fixed_start, fixed_end));
}

void BranchTree::add(const Own& own, bool fixed_end, BranchSample landing) {
    Polyline path = own.path;
    if (path.size() < 2) path.insert(path.begin(), branches[own.parent.branch].points[own.parent.sample]);
    const double total = geometry::length_of(path);
    clear(path, total);
    if (landing.branch >= 0) {
        std::ranges::reverse(path);
        clear(path, total);
        std::ranges::reverse(path);
    }
    Centreline line = recentred(path, wall_, step_, false, fixed_end);
    const int parent_sample = junction(own.parent, line);
    connect(line, branches[own.parent.branch].points[parent_sample]);
    if (landing.branch >= 0) {
        std::ranges::reverse(line.points);
        const int sample = junction(landing, line);
        connect(line, branches[landing.branch].points[sample]);
        std::ranges::reverse(line.points);
        line.radii = inscribed_radii(line.points, wall_);
    }
    append(own.parent.branch, parent_sample, std::move(line));
}

BranchTree::Own BranchTree::own_part(const Polyline& path) const {
    for (std::size_t i = path.size(); i-- > 0;) {
        const BranchSample at = contact(path[i]);
        if (at.branch >= 0) return {at, {path.begin() + static_cast<std::ptrdiff_t>(i) + 1, path.end()}};
    }
    return {{0, 0}, path};
}

double BranchTree::width(const Own& own) const {
    double widest = 0;
    for (const Vec3& p : own.path) widest = std::max(widest, wall_.distance(p));
    return widest;
}

bool BranchTree::is_spur(const Own& own) const {
    if (own.path.size() < 4) return true;
    const CentrelineBranch& parent = branches[own.parent.branch];
    const double length = geometry::length_of(own.path);
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
void BranchTree::clear(Polyline& path, double total) const {
    double passed = 0;
    std::size_t first = 0;
    while (first + 2 < path.size() && passed < total / 3) {
        const double own = 0.5 * wall_.distance(path[first]);
        bool near = false;
        for (const CentrelineBranch& branch : branches) {
            for (std::size_t i = 0; i < branch.points.size() && !near; ++i)
                near = (path[first] - branch.points[i]).norm() < branch.radii[i] + own;
        }
        if (!near) break;
        passed += (path[first + 1] - path[first]).norm();
        ++first;
    }
    path.erase(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(first));
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

void trim_tip(Polyline& path, const geometry::MeshQuery& wall) {
    double passed = 0;
    while (path.size() > 3) {
        if (passed > 1.2 * wall.distance(path.back())) break;
        passed += (path[path.size() - 2] - path.back()).norm();
        path.pop_back();
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

void sort_stems_first(std::vector<RootedPath>& paths, const geometry::MeshQuery& wall) {
    const auto bulk = [&wall](const Polyline& path) {
        double sum = 0;
        for (std::size_t i = 1; i < path.size(); ++i)
            sum += (path[i] - path[i - 1]).norm() * wall.distance(path[i]);
        return sum;
    };
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < paths.size(); ++i) order.emplace_back(-bulk(paths[i].points), i);
    std::ranges::sort(order);
    std::vector<RootedPath> sorted;
    for (const auto& [less, i] : order) sorted.push_back(std::move(paths[i]));
    paths = std::move(sorted);
}

namespace {

constexpr int rays = 36;
constexpr double reach = 1.4;  // of a ray, in medians of the fan
constexpr int rounds = 6;

void smooth(std::vector<Vec3>& points, int passes) {
    for (int pass = 0; pass < passes; ++pass) {
        Vec3 before = points[0];
        for (std::size_t i = 1; i + 1 < points.size(); ++i) {
            const Vec3 here = points[i];
            points[i] = 0.25 * before + 0.5 * here + 0.25 * points[i + 1];
            before = here;
        }
    }
}

/// Offset from the point to the centroid of the cross-section through it; false where the lumen is open.
bool offset_to_centroid(const geometry::MeshQuery& wall, const Vec3& point, const Vec3& tangent,
                        Vec3& offset) {
    const Vec3 u = tangent.unitOrthogonal(), v = tangent.cross(u);
    std::array<double, rays> length, sorted;
    std::array<Vec3, rays> direction;
    for (int k = 0; k < rays; ++k) {
        const double angle = 2 * std::numbers::pi * k / rays;
        direction[k] = geometry::cos(angle) * u + geometry::sin(angle) * v;
        length[k] = wall.first_hit(point, direction[k]);
    }
    sorted = length;
    std::nth_element(sorted.begin(), sorted.begin() + rays / 2, sorted.end());
    const double median = sorted[rays / 2];
    if (!std::isfinite(median)) return false;
    // Rays that leave through an opening are missing; those into a side branch are only cut off.
    int missed = 0;
    for (double& l : length) {
        missed += !std::isfinite(l);
        l = std::min(l, reach * median);
    }
    if (missed > 0) return false;
    Vec3 moment = Vec3::Zero();
    double area = 0;
    for (int k = 0; k < rays; ++k) {
        const int n = (k + 1) % rays;
        const double own = length[k] * length[n];  // twice the triangle's area, but for a common factor
        moment += own * (length[k] * direction[k] + length[n] * direction[n]) / 3;
        area += own;
    }
    offset = moment / area;
    return true;
}

/// Fills in unknown offsets, linear between known ones; 0 beyond a fixed end, constant beyond a free one.
void bridge(std::vector<Vec3>& offsets, const std::vector<char>& known) {
    const int count = static_cast<int>(offsets.size());
    int last = -1;
    for (int i = 0; i <= count; ++i) {
        if (i < count && !known[i]) continue;
        for (int k = last + 1; k < i; ++k) {
            if (last < 0 && i == count) continue;
            const double part = last < 0 ? 1 : i == count ? 0 : static_cast<double>(k - last) / (i - last);
            offsets[k] = (1 - part) * (last < 0 ? Vec3(Vec3::Zero()) : offsets[last]) +
                         part * (i == count ? Vec3(Vec3::Zero()) : offsets[i]);
        }
        last = i;
    }
}

}  // namespace

std::vector<double> inscribed_radii(const Polyline& points, const geometry::MeshQuery& wall) {
    std::vector<double> radii;
    for (const Vec3& p : points) radii.push_back(wall.distance(p));
    return radii;
}

Centreline recentred(const Polyline& rough, const geometry::MeshQuery& wall, double step, bool fixed_start,
                     bool fixed_end) {
    Polyline points = geometry::resampled(rough, step);
    smooth(points, 10);
    for (int round = 0; round < rounds; ++round) {
        const int count = static_cast<int>(points.size());
        std::vector<Vec3> offsets(points.size(), Vec3::Zero());
        std::vector<char> known(points.size(), 0);
        for (int i = 0; i < count; ++i) {
            if ((i == 0 && fixed_start) || (i == count - 1 && fixed_end)) {
                known[i] = 1;
                continue;
            }
            const double radius = wall.distance(points[i]);
            const int span = std::max(2, static_cast<int>(std::lround(0.5 * radius / step)));
            const Vec3 along = points[std::min(count - 1, i + span)] - points[std::max(0, i - span)];
            if (along.norm() == 0) continue;
            known[i] = offset_to_centroid(wall, points[i], along.normalized(), offsets[i]);
        }
        bridge(offsets, known);
        for (int i = 0; i < count; ++i) points[i] += offsets[i];
        smooth(points, 2);
        points = geometry::resampled(points, step);
    }
    std::vector<double> radii = inscribed_radii(points, wall);
    return {std::move(points), std::move(radii)};
}

}  // namespace anatomy
