#include "engine/anatomy/lumen_tracing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>

#include "engine/anatomy/centreline.h"
#include "engine/anatomy/lumen_voxels.h"

namespace engine {
namespace {

using physics::CentrelineBranch;
using physics::Polyline;
using physics::Vec3;

/// A voxel is covered by a ball of a centreline grown by this much: what sticks out farther is a vessel.
constexpr double cover = 1.9;
/// More spurs or tips than this are told, not followed.
constexpr int most_tips = 60;

struct Contact {
    int branch = -1, sample = -1;
};

/// Branches so far, and where a new one leaves them.
class BranchTree {
public:
    BranchTree(const MeshQuery& wall, double step) : wall_(wall), step_(step) {}

    std::vector<CentrelineBranch> branches;

    void add_root(const Polyline& way, bool fixed_start, bool fixed_end) {
        append(-1, -1, recentred(way, wall_, step_, fixed_start, fixed_end));
    }

    /// Whether a place is inside the ball of a branch, and which; of several the one that holds it deepest.
    Contact contact(const Vec3& x, double grown = 1) const {
        Contact best;
        double least = 0;
        for (int b = 0; b < static_cast<int>(branches.size()); ++b) {
            const CentrelineBranch& branch = branches[b];
            for (int i = 0; i < static_cast<int>(branch.points.size()); ++i) {
                const double r = grown * branch.radii[i],
                             power = (x - branch.points[i]).squaredNorm() - r * r;
                if (power < least) least = power, best = {b, i};
            }
        }
        return best;
    }

    /// The part of a way from the root to a tip that lies outside every branch, and which it leaves.
    struct Own {
        Contact parent;
        Polyline way;  // from the first place outside
    };
    Own own_part(const Polyline& way) const {
        for (std::size_t i = way.size(); i-- > 0;) {
            const Contact at = contact(way[i]);
            if (at.branch >= 0) return {at, {way.begin() + static_cast<std::ptrdiff_t>(i) + 1, way.end()}};
        }
        return {{0, 0}, way};
    }

    /// The widest ball along the own part [mm].
    double width(const Own& own) const {
        double widest = 0;
        for (const Vec3& p : own.way) widest = std::max(widest, wall_.distance(p));
        return widest;
    }
    /// A bulge, not a branch: shorter than the diameter of the vessel that it leaves, or than it is wide and
    /// half as much, as a sac on a neck is not. Where the vessel is narrowed, its width nearby counts.
    bool is_spur(const Own& own) const {
        if (own.way.size() < 4) return true;
        const CentrelineBranch& parent = branches[own.parent.branch];
        const double length = length_of(own.way);
        double widest = 0.75 * width(own);
        for (std::size_t i = 0; i < parent.points.size(); ++i)
            if ((parent.points[i] - parent.points[own.parent.sample]).norm() < length)
                widest = std::max(widest, parent.radii[i]);
        return length < 2 * widest;
    }

    /// A branch along the own part; `landing`: the branch that its end runs into, or none.
    void add(const Own& own, bool fixed_end, Contact landing = {}) {
        Polyline way = own.way;
        const double total = length_of(way);
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

private:
    /// Drops the start of a way while its own lumen still opens into others, up to a third of it.
    void clear(Polyline& way, double total) const {
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
    /// The sample of the parent that the line, carried on backwards, comes nearest to.
    int junction(const Contact& at, const Centreline& line) const {
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
            // A longer way back costs a little, so that a line along the parent does not run down it.
            const double off = (to - along * back).norm() + 0.1 * along;
            if (off < least) least = off, best = i;
        }
        return best;
    }
    /// Puts a straight piece from the place to the start of the line.
    void connect(Centreline& line, const Vec3& place) const {
        Polyline piece = resampled({place, line.points.front()}, step_);
        piece.pop_back();
        line.points.insert(line.points.begin(), piece.begin(), piece.end());
        line.radii = inscribed_radii(line.points, wall_);
    }
    void append(int parent, int parent_sample, Centreline line) {
        branches.push_back({"", parent, parent_sample, std::move(line.points), std::move(line.radii)});
    }

    const MeshQuery& wall_;
    double step_;
};

/// Where a way that ends at a blind wall still has the middle of the vessel to follow.
void trim_tip(Polyline& way, const MeshQuery& wall) {
    double passed = 0;
    while (way.size() > 3) {
        if (passed > 1.2 * wall.distance(way.back())) break;
        passed += (way[way.size() - 2] - way.back()).norm();
        way.pop_back();
    }
}

VesselTip tip_of(const CentrelineBranch& branch, const Vec3& apex, bool start) {
    const std::size_t last = branch.points.size() - 1, span = std::min<std::size_t>(last, 3);
    const std::size_t at = start ? 0 : last, before = start ? span : last - span;
    return {apex, branch.points[at], (branch.points[at] - branch.points[before]).normalized(),
            branch.radii[at]};
}

/// Length times width: what makes one vessel the stem of others.
double bulk(const Polyline& way, const MeshQuery& wall) {
    double sum = 0;
    for (std::size_t i = 1; i < way.size(); ++i) sum += (way[i] - way[i - 1]).norm() * wall.distance(way[i]);
    return sum;
}

class VoxelTracer {
public:
    VoxelTracer(const physics::TriangleMesh& open, const std::vector<MeshOpening>& openings, int inlet,
                const TracingOptions& options)
        : openings_(openings),
          inlet_(inlet),
          options_(options),
          wall_(open),
          closed_(capped(open, loops())),
          voxels_(closed_, options.voxel),
          tree_(wall_, options.step) {}

    TracedLumen run() {
        if (voxels_.count() == 0) {
            for (int e = 0; e < static_cast<int>(openings_.size()); ++e) result_.unreached.push_back(e);
            return std::move(result_);
        }
        report(0.1);
        distances_ = voxels_.distances(wall_, options_.threads);
        report(0.5);
        root_ = inlet_ >= 0 ? behind(inlet_) : farthest(voxels_.nearest(closed_.vertices[0]));
        ways_ = cheapest_ways(voxels_, distances_, root_);
        report(0.75);
        covered_.assign(static_cast<std::size_t>(voxels_.count()), 0);
        follow_ends();
        report(0.9);
        follow_tips();
        result_.branches = std::move(tree_.branches);
        report(1);
        return std::move(result_);
    }

private:
    void report(double part) const {
        if (options_.progress) options_.progress(part);
    }
    std::vector<BoundaryLoop> loops() const {
        std::vector<BoundaryLoop> all;
        for (const MeshOpening& opening : openings_) all.push_back(opening.loop);
        return all;
    }
    int behind(int opening) const {
        const MeshOpening& at = openings_[opening];
        return voxels_.nearest(at.loop.centroid - voxels_.size() * at.normal);
    }
    int farthest(int from) const {
        const VoxelWays ways = cheapest_ways(voxels_, distances_, from);
        int best = from;
        for (int i = 0; i < voxels_.count(); ++i)
            if (ways.reached(i) && ways.length[i] > ways.length[best]) best = i;
        return best;
    }
    Polyline way_to(int voxel) const {
        Polyline way;
        for (const int v : ways_.way(voxel)) way.push_back(voxels_.centre(v));
        std::reverse(way.begin(), way.end());
        if (inlet_ >= 0) way.insert(way.begin(), openings_[inlet_].loop.centroid);
        return way;
    }

    void follow_ends() {
        struct Way {
            int opening;
            Polyline points;
            double bulk;
        };
        std::vector<Way> ways;
        for (int e = 0; e < static_cast<int>(openings_.size()); ++e) {
            if (e == inlet_) continue;
            const int voxel = behind(e);
            if (!ways_.reached(voxel) || voxel == root_) {
                result_.unreached.push_back(e);
                continue;
            }
            Way way{e, way_to(voxel), 0};
            way.points.push_back(openings_[e].loop.centroid);
            way.bulk = bulk(way.points, wall_);
            ways.push_back(std::move(way));
        }
        std::stable_sort(ways.begin(), ways.end(),
                         [](const Way& a, const Way& b) { return a.bulk > b.bulk; });
        for (const Way& way : ways) {
            if (tree_.branches.empty())
                tree_.add_root(way.points, true, true);
            else
                tree_.add(tree_.own_part(way.points), true);
            finish(way.opening);
        }
    }

    /// After a branch was added.
    void finish(int opening) {
        result_.end_of_branch.push_back(opening);
        const CentrelineBranch& branch = tree_.branches.back();
        for (std::size_t i = 0; i < branch.points.size(); ++i)
            mark(branch.points[i], cover * branch.radii[i]);
    }
    void mark(const Vec3& centre, double radius) {
        voxels_.ball(centre, std::max(radius, 2 * voxels_.size()), [this](int v) { covered_[v] = 1; });
    }

    void follow_tips() {
        while (static_cast<int>(result_.tips.size()) + result_.spurs < most_tips) {
            int tip = -1;
            for (int v = 0; v < voxels_.count(); ++v) {
                if (covered_[v] || !ways_.reached(v)) continue;
                if (tip < 0 || ways_.length[v] > ways_.length[tip]) tip = v;
            }
            if (tip < 0) break;
            if (tree_.branches.empty())
                first_blind(tip);
            else
                follow_tip(tip);
        }
    }

    /// The stem of a lumen without openings, from blind root to blind tip.
    void first_blind(int tip) {
        Polyline way = way_to(tip);
        const bool from_tip = inlet_ < 0;
        if (from_tip) {
            std::reverse(way.begin(), way.end());
            trim_tip(way, wall_);
            std::reverse(way.begin(), way.end());
        }
        trim_tip(way, wall_);
        tree_.add_root(way, !from_tip, false);
        if (from_tip) result_.tips.push_back(tip_of(tree_.branches[0], voxels_.centre(root_), true));
        result_.tips.push_back(tip_of(tree_.branches[0], voxels_.centre(tip), false));
        finish(-1);
        if (from_tip) mark_near(root_, 2 * tree_.branches[0].radii.front());
        mark_near(tip, 2 * tree_.branches[0].radii.back());
    }

    void follow_tip(int tip) {
        const Polyline whole = way_to(tip);
        const BranchTree::Own own = tree_.own_part(whole);
        const double width = std::max(voxels_.size(), tree_.width(own)), length = length_of(own.way);
        if (tree_.is_spur(own)) {
            result_.spurs += length >= width;
            mark_near(tip, std::max(2 * width, length));
            return;
        }
        if (const Polyline other = across(tip, own.way, width); !other.empty()) {
            const BranchTree::Own back = tree_.own_part(other);
            BranchTree::Own ring = own;
            ring.way.insert(ring.way.end(), back.way.rbegin(), back.way.rend());
            tree_.add(ring, false, back.parent);
            ++result_.loops;
            finish(-1);
            mark_near(tip, 2 * width);
            return;
        }
        BranchTree::Own trimmed = own;
        trim_tip(trimmed.way, wall_);
        tree_.add(trimmed, false);
        result_.tips.push_back(tip_of(tree_.branches.back(), voxels_.centre(tip), false));
        finish(-1);
        mark_near(tip, 2 * tree_.branches.back().radii.back());
    }
    void mark_near(int tip, double radius) { mark(voxels_.centre(tip), radius); }

    /// Where two fronts of ways have met at the tip, the way to the other side; else empty.
    Polyline across(int tip, const Polyline& own, double width) const {
        Polyline best;
        double longest = 0;
        voxels_.ball(voxels_.centre(tip), 2.5 * voxels_.size(), [&](int v) {
            if (!ways_.reached(v) || ways_.from[v] < 0) return;
            const BranchTree::Own other = tree_.own_part(way_to(v));
            std::size_t apart = 0;
            for (const Vec3& p : other.way) {
                double least = std::numeric_limits<double>::infinity();
                for (const Vec3& q : own) least = std::min(least, (p - q).norm());
                apart += least > 1.5 * width;
            }
            const double length = length_of(other.way);
            if (2 * apart < other.way.size() || length < 2 * width || length < longest) return;
            longest = length;
            best = way_to(v);
        });
        return best;
    }

    const std::vector<MeshOpening>& openings_;
    int inlet_;
    TracingOptions options_;
    MeshQuery wall_;
    physics::TriangleMesh closed_;
    LumenVoxels voxels_;
    BranchTree tree_;
    std::vector<float> distances_;
    VoxelWays ways_;
    std::vector<char> covered_;
    int root_ = -1;
    TracedLumen result_;
};

/// Given lines as a graph: samples linked along lines, and from the ends of a line to the nearest sample of
/// another when that is in the same piece of lumen.
class LineTracer {
public:
    LineTracer(const physics::TriangleMesh& open, const std::vector<MeshOpening>& openings, int inlet,
               const std::vector<Polyline>& lines, const TracingOptions& options)
        : openings_(openings), inlet_(inlet), wall_(open), tree_(wall_, options.step) {
        std::vector<BoundaryLoop> loops;
        for (const MeshOpening& opening : openings) loops.push_back(opening.loop);
        const MeshQuery closed(capped(open, loops));
        for (const Polyline& line : lines) add_line(closed, resampled(line, options.step));
        link_lines();
    }

    TracedLumen run() {
        if (points_.empty()) return std::move(result_);
        find_root();
        find_ways();
        follow();
        result_.branches = std::move(tree_.branches);
        return std::move(result_);
    }

private:
    void add_line(const MeshQuery& closed, const Polyline& line) {
        const int first = static_cast<int>(points_.size());
        for (const Vec3& p : line) {
            if (!closed.encloses(p)) continue;
            const int here = static_cast<int>(points_.size());
            points_.push_back(p);
            line_.push_back(lines_);
            links_.emplace_back();
            if (here > first) link(here - 1, here);
        }
        if (static_cast<int>(points_.size()) > first) {
            line_ends_.push_back(first);
            line_ends_.push_back(static_cast<int>(points_.size()) - 1);
        }
        ++lines_;
    }
    void link(int a, int b) {
        links_[a].push_back(b);
        links_[b].push_back(a);
    }
    void link_lines() {
        for (const int end : line_ends_) {
            int nearest = -1;
            double least = std::numeric_limits<double>::infinity();
            for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
                if (line_[i] == line_[end]) continue;
                const double distance = (points_[i] - points_[end]).norm() - wall_.distance(points_[i]);
                if (distance < least) least = distance, nearest = i;
            }
            if (nearest < 0 || least > wall_.distance(points_[end]))
                free_.push_back(end);
            else
                link(end, nearest);
        }
    }
    int nearest_to(const Vec3& x) const {
        return static_cast<int>(
            std::min_element(points_.begin(), points_.end(),
                             [&](const Vec3& a, const Vec3& b) { return (a - x).norm() < (b - x).norm(); }) -
            points_.begin());
    }
    void find_root() {
        if (inlet_ >= 0) {
            root_ = nearest_to(openings_[inlet_].loop.centroid);
            return;
        }
        root_ = free_.empty() ? 0 : free_[0];
        for (const int end : free_)
            if (wall_.distance(points_[end]) > wall_.distance(points_[root_])) root_ = end;
    }
    void find_ways() {
        from_.assign(points_.size(), -1);
        length_.assign(points_.size(), std::numeric_limits<double>::infinity());
        length_[root_] = 0;
        std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> open;
        open.emplace(0.0, root_);
        while (!open.empty()) {
            const auto [at, i] = open.top();
            open.pop();
            if (at > length_[i]) continue;
            for (const int j : links_[i]) {
                const double next = at + (points_[j] - points_[i]).norm();
                if (next >= length_[j]) continue;
                length_[j] = next, from_[j] = i;
                open.emplace(next, j);
            }
        }
    }
    Polyline way_to(int node) const {
        Polyline way;
        for (; node >= 0; node = from_[node]) way.push_back(points_[node]);
        std::reverse(way.begin(), way.end());
        if (inlet_ >= 0) way.insert(way.begin(), openings_[inlet_].loop.centroid);
        return way;
    }
    void follow() {
        struct Way {
            int opening;
            Polyline points;
            double bulk;
        };
        std::vector<Way> ways;
        std::vector<int> taken = {root_};
        for (int e = 0; e < static_cast<int>(openings_.size()); ++e) {
            if (e == inlet_) continue;
            const int node = nearest_to(openings_[e].loop.centroid);
            const double gap = (points_[node] - openings_[e].loop.centroid).norm();
            if (!std::isfinite(length_[node]) || gap > 4 * openings_[e].radius) {
                result_.unreached.push_back(e);
                continue;
            }
            taken.push_back(node);
            ways.push_back({e, way_to(node), 0});
            ways.back().points.push_back(openings_[e].loop.centroid);
        }
        for (const int end : free_) {
            const bool near = std::any_of(taken.begin(), taken.end(), [&](int node) {
                return (points_[node] - points_[end]).norm() < 2 * wall_.distance(points_[node]);
            });
            if (!near && std::isfinite(length_[end])) ways.push_back({-1, way_to(end), 0});
        }
        for (Way& way : ways) way.bulk = bulk(way.points, wall_);
        std::stable_sort(ways.begin(), ways.end(),
                         [](const Way& a, const Way& b) { return a.bulk > b.bulk; });
        for (Way& way : ways) {
            const Vec3 apex = way.points.back();
            if (way.opening < 0) trim_tip(way.points, wall_);
            if (tree_.branches.empty()) {
                tree_.add_root(way.points, inlet_ >= 0, way.opening >= 0);
                if (inlet_ < 0) result_.tips.push_back(tip_of(tree_.branches[0], points_[root_], true));
            } else {
                const BranchTree::Own own = tree_.own_part(way.points);
                if (way.opening < 0 && tree_.is_spur(own)) {
                    ++result_.spurs;
                    continue;
                }
                tree_.add(own, way.opening >= 0);
            }
            result_.end_of_branch.push_back(way.opening);
            if (way.opening < 0) result_.tips.push_back(tip_of(tree_.branches.back(), apex, false));
        }
    }

    const std::vector<MeshOpening>& openings_;
    int inlet_;
    MeshQuery wall_;
    BranchTree tree_;
    Polyline points_;
    std::vector<int> line_;  // of each point
    int lines_ = 0;
    std::vector<std::vector<int>> links_;
    std::vector<int> line_ends_, free_;  // points; free ones are linked to no other line
    int root_ = -1;
    std::vector<int> from_;
    std::vector<double> length_;  // from the root [mm]
    TracedLumen result_;
};

}  // namespace

TracedLumen trace_lines(const physics::TriangleMesh& open, const std::vector<MeshOpening>& openings,
                        int inlet, const std::vector<Polyline>& lines, const TracingOptions& options) {
    return LineTracer(open, openings, inlet, lines, options).run();
}

TracedLumen trace_lumen(const physics::TriangleMesh& open, const std::vector<MeshOpening>& openings,
                        int inlet, const TracingOptions& options) {
    return VoxelTracer(open, openings, inlet, options).run();
}

}  // namespace engine
