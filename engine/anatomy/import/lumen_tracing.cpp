#include "engine/anatomy/import/lumen_tracing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <unordered_set>
#include <utility>

#include "engine/anatomy/import/branch_tree.h"
#include "engine/anatomy/import/lumen_voxels.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

using geometry::Polyline;
using geometry::Vec3;

/// Given lines as a graph: samples are linked along lines, and the ends of a line to the nearest sample of
/// another when that is in the same piece of lumen.
class LineTracer {
public:
    LineTracer(const geometry::TriangleMesh& open, const std::vector<MeshOpening>& openings, int inlet,
               const std::vector<Polyline>& lines, const TracingOptions& options)
        : openings_(openings), inlet_(inlet), wall_(open), tree_(wall_, options.step) {
        std::vector<geometry::BoundaryLoop> loops;
        for (const MeshOpening& opening : openings) loops.push_back(opening.loop);
        const geometry::MeshQuery closed(geometry::capped(open, loops));
        for (const Polyline& line : lines) add_line(closed, geometry::resampled(line, options.step));
        link_lines();
    }

    TracedLumen run() {
        if (points_.empty()) return std::move(result_);
        find_root();
        find_paths();
        follow();
        result_.branches = std::move(tree_.branches);
        return std::move(result_);
    }

private:
    void add_line(const geometry::MeshQuery& closed, const Polyline& line) {
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
        const auto distance = [&](const Vec3& point) { return (point - x).norm(); };
        return static_cast<int>(std::ranges::min_element(points_, {}, distance) - points_.begin());
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
    void find_paths() {
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
    Polyline path_to(int node) const {
        Polyline path;
        for (; node >= 0; node = from_[node]) path.push_back(points_[node]);
        std::ranges::reverse(path);
        if (inlet_ >= 0) path.insert(path.begin(), openings_[inlet_].loop.centroid);
        return path;
    }
    void follow() {
        std::vector<RootedPath> paths;
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
            paths.push_back({e, path_to(node)});
            paths.back().points.push_back(openings_[e].loop.centroid);
        }
        for (const int end : free_) {
            const bool near = std::ranges::any_of(taken, [&](int node) {
                return (points_[node] - points_[end]).norm() < 2 * wall_.distance(points_[node]);
            });
            if (!near && std::isfinite(length_[end])) paths.push_back({-1, path_to(end)});
        }
        sort_stems_first(paths, wall_);
        for (RootedPath& path : paths) {
            const Vec3 apex = path.points.back();
            if (path.opening < 0) trim_tip(path.points, wall_);
            if (tree_.branches.empty()) {
                tree_.add_root(path.points, inlet_ >= 0, path.opening >= 0);
                if (inlet_ < 0) result_.tips.push_back(tip_of(tree_.branches, 0, points_[root_], true));
            } else {
                const BranchTree::Own own = tree_.own_part(path.points);
                if (path.opening < 0 && tree_.is_spur(own)) {
                    ++result_.spurs;
                    continue;
                }
                tree_.add(own, path.opening >= 0);
            }
            result_.end_of_branch.push_back(path.opening);
            if (path.opening < 0) {
                const int last = static_cast<int>(tree_.branches.size()) - 1;
                result_.tips.push_back(tip_of(tree_.branches, last, apex, false));
            }
        }
    }

    const std::vector<MeshOpening>& openings_;
    int inlet_;
    geometry::MeshQuery wall_;
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

using geometry::CentrelineBranch;

/// A voxel is covered by a ball of a centreline enlarged by this factor: what lies outside is another vessel.
constexpr double cover = 1.9;
/// Rays that measure the section of a flat vessel, and how far they may reach, in inscribed radii.
constexpr int section_fan = 24;
constexpr double widest_section = 4;
/// A ray this many times longer than its shorter neighbour has left the section through a side branch.
constexpr double section_rise = 1.5;

class VoxelTracer {
public:
    VoxelTracer(const geometry::TriangleMesh& open, const std::vector<MeshOpening>& openings, int inlet,
                const TracingOptions& options)
        : openings_(openings),
          inlet_(inlet),
          options_(options),
          wall_(open),
          closed_(geometry::capped(open, loops())),
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
        root_ = inlet_ >= 0 ? behind(inlet_) : most_steps_from(voxels_, voxels_.nearest(closed_.vertices[0]));
        paths_ = cheapest_paths(voxels_, distances_, root_);
        report(0.75);
        const auto count = static_cast<std::size_t>(voxels_.count());
        covered_.assign(count, 0);
        owner_.assign(count, {});
        depth_.assign(count, 0);
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
    std::vector<geometry::BoundaryLoop> loops() const {
        std::vector<geometry::BoundaryLoop> all;
        for (const MeshOpening& opening : openings_) all.push_back(opening.loop);
        return all;
    }
    int behind(int opening) const {
        const MeshOpening& at = openings_[opening];
        return voxels_.nearest(at.loop.centroid - voxels_.size() * at.normal);
    }
    Polyline path_to(int voxel) const {
        Polyline path;
        for (const int v : paths_.path(voxel)) path.push_back(voxels_.centre(v));
        std::ranges::reverse(path);
        if (inlet_ >= 0) path.insert(path.begin(), openings_[inlet_].loop.centroid);
        return path;
    }
    /// The part of the path from the root to a voxel that lies outside every branch.
    BranchTree::Own own_part(int voxel) const {
        BranchTree::Own own{{0, 0}, {}};
        for (; voxel >= 0; voxel = paths_.from[voxel]) {
            if (owner_[voxel].branch >= 0) {
                own.parent = owner_[voxel];
                break;
            }
            own.path.push_back(voxels_.centre(voxel));
        }
        std::ranges::reverse(own.path);
        return own;
    }

    void follow_ends() {
        std::vector<RootedPath> paths;
        for (int e = 0; e < static_cast<int>(openings_.size()); ++e) {
            if (e == inlet_) continue;
            const int voxel = behind(e);
            if (!paths_.reached(voxel) || voxel == root_) {
                result_.unreached.push_back(e);
                continue;
            }
            RootedPath path{e, path_to(voxel)};
            path.points.push_back(openings_[e].loop.centroid);
            paths.push_back(std::move(path));
        }
        sort_stems_first(paths, wall_);
        for (const RootedPath& path : paths) {
            if (tree_.branches.empty()) {
                tree_.add_root(path.points, true, true);
            } else {
                BranchTree::Own own = own_part(behind(path.opening));
                own.path.push_back(path.points.back());
                tree_.add(own, true);
            }
            finish(path.opening);
        }
    }

    /// To be called after a branch was added.
    void finish(int opening) {
        result_.end_of_branch.push_back(opening);
        const CentrelineBranch& branch = tree_.branches.back();
        const int count = static_cast<int>(branch.points.size());
        double since = std::numeric_limits<double>::infinity();  // the last ball [mm]
        for (int i = 0; i < count; ++i) {
            if (i > 0) since += (branch.points[i] - branch.points[i - 1]).norm();
            if (since >= 0.1 * branch.radii[i] || i + 1 == count) {
                since = 0;
                mark(branch.points[i], cover * branch.radii[i]);
                own(static_cast<int>(tree_.branches.size()) - 1, i);
            }
            cover_section(branch, i);
        }
    }
    void mark(const Vec3& centre, double radius) {
        voxels_.ball(centre, std::max(radius, 2 * voxels_.size()), [this](int v) { covered_[v] = 1; });
    }
    /// A voxel in the balls of several samples belongs to the one that holds it deepest.
    void own(int branch, int sample) {
        const Vec3& centre = tree_.branches[branch].points[sample];
        const double radius = tree_.branches[branch].radii[sample];
        voxels_.ball(centre, radius, [&](int v) {
            const auto power =
                static_cast<float>((voxels_.centre(v) - centre).squaredNorm() - radius * radius);
            if (power < depth_[v]) depth_[v] = power, owner_[v] = {branch, sample};
        });
    }
    /// Covers the section of a vessel that is flat, as veins are: what lies on both sides of the centreline
    /// as far as the nearer of the two walls.
    void cover_section(const CentrelineBranch& branch, int sample) {
        const int last = static_cast<int>(branch.points.size()) - 1;
        const Vec3& centre = branch.points[sample];
        const double radius = branch.radii[sample];
        const Vec3 along = branch.points[std::min(last, sample + 2)] - branch.points[std::max(0, sample - 2)];
        if (along.norm() == 0) return;
        const Vec3 u = along.normalized().unitOrthogonal(), v = along.normalized().cross(u);
        constexpr int half = section_fan / 2;
        std::array<Vec3, half> direction;
        std::array<double, half> reach;
        for (int k = 0; k < half; ++k) {
            const double angle = std::numbers::pi * k / half;
            direction[k] = geometry::cos(angle) * u + geometry::sin(angle) * v;
            reach[k] = std::min({wall_.first_hit(centre, direction[k]),
                                 wall_.first_hit(centre, -direction[k]), widest_section * radius});
        }
        for (int k = 0; k < half; ++k) {
            const double beside = std::min(reach[(k + 1) % half], reach[(k + half - 1) % half]);
            const double most = std::min(reach[k], section_rise * beside);
            for (double at = cover * radius; at < most; at += voxels_.size()) {
                for (const double side : {-at, at}) mark(centre + side * direction[k], 0.15 * at);
            }
        }
    }

    void follow_tips() {
        std::vector<int> farthest_first;
        for (int v = 0; v < voxels_.count(); ++v)
            if (!covered_[v] && paths_.reached(v)) farthest_first.push_back(v);
        std::ranges::stable_sort(farthest_first,
                                 [this](int a, int b) { return paths_.length[a] > paths_.length[b]; });
        for (const int tip : farthest_first) {
            if (covered_[tip]) continue;
            if (static_cast<int>(result_.tips.size()) > options_.most_tips) break;
            if (tree_.branches.empty())
                first_blind(tip);
            else
                follow_tip(tip);
        }
    }

    /// The stem of a lumen without openings, from blind root to blind tip.
    void first_blind(int tip) {
        Polyline path = path_to(tip);
        const bool from_tip = inlet_ < 0;
        if (from_tip) {
            std::ranges::reverse(path);
            trim_tip(path, wall_);
            std::ranges::reverse(path);
        }
        trim_tip(path, wall_);
        tree_.add_root(path, !from_tip, false);
        if (from_tip) result_.tips.push_back(tip_of(tree_.branches, 0, voxels_.centre(root_), true));
        result_.tips.push_back(tip_of(tree_.branches, 0, voxels_.centre(tip), false));
        finish(-1);
        if (from_tip) mark_near(root_, 2 * tree_.branches[0].radii.front());
        mark_near(tip, 2 * tree_.branches[0].radii.back());
    }

    void follow_tip(int tip) {
        const BranchTree::Own own = own_part(tip);
        const double width = std::max(voxels_.size(), tree_.width(own)),
                     length = geometry::length_of(own.path);
        if (tree_.is_spur(own)) {
            result_.spurs += length >= width;
            mark_near(tip, std::max(2 * width, length));
            return;
        }
        if (const BranchTree::Own back = across(tip, own.path, width); !back.path.empty()) {
            BranchTree::Own ring = own;
            ring.path.insert(ring.path.end(), back.path.rbegin(), back.path.rend());
            tree_.add(ring, false, back.parent);
            ++result_.loops;
            finish(-1);
            mark_near(tip, 2 * width);
            return;
        }
        BranchTree::Own trimmed = own;
        trim_tip(trimmed.path, wall_);
        tree_.add(trimmed, false);
        result_.tips.push_back(
            tip_of(tree_.branches, static_cast<int>(tree_.branches.size()) - 1, voxels_.centre(tip), false));
        finish(-1);
        mark_near(tip, 2 * tree_.branches.back().radii.back());
    }
    void mark_near(int tip, double radius) { mark(voxels_.centre(tip), radius); }

    /// The own part of the path to the other side where two fronts of paths have met at the tip; else empty.
    BranchTree::Own across(int tip, const Polyline& own, double width) const {
        BranchTree::Own best;
        double longest = 0;
        std::unordered_set<int> on_path;
        for (int v = tip; v >= 0 && owner_[v].branch < 0; v = paths_.from[v]) on_path.insert(v);
        const auto joins_path = [&](int v) {
            while (v >= 0 && owner_[v].branch < 0 && !on_path.contains(v)) v = paths_.from[v];
            return v >= 0 && on_path.contains(v);
        };
        voxels_.ball(voxels_.centre(tip), 2.5 * voxels_.size(), [&](int v) {
            if (!paths_.reached(v) || paths_.from[v] < 0 || joins_path(v)) return;
            const BranchTree::Own other = own_part(v);
            std::size_t apart = 0;
            for (const Vec3& p : other.path) {
                double least = std::numeric_limits<double>::infinity();
                for (const Vec3& q : own) least = std::min(least, (p - q).norm());
                apart += least > 1.5 * width;
            }
            const double length = geometry::length_of(other.path);
            if (2 * apart < other.path.size() || length < 2 * width || length < longest) return;
            longest = length;
            best = other;
        });
        return best;
    }

    const std::vector<MeshOpening>& openings_;
    int inlet_;
    TracingOptions options_;
    geometry::MeshQuery wall_;
    geometry::TriangleMesh closed_;
    LumenVoxels voxels_;
    BranchTree tree_;
    std::vector<float> distances_;
    VoxelPaths paths_;
    std::vector<char> covered_;
    std::vector<BranchSample> owner_;  // of each voxel in the ball of a sample
    std::vector<float> depth_;         // of the voxel in that ball: squared distance minus squared radius
    int root_ = -1;
    TracedLumen result_;
};

}  // namespace

TracedLumen trace_lines(const geometry::TriangleMesh& open, const std::vector<MeshOpening>& openings,
                        int inlet, const std::vector<Polyline>& lines, const TracingOptions& options) {
    return LineTracer(open, openings, inlet, lines, options).run();
}

TracedLumen trace_lumen(const geometry::TriangleMesh& open, const std::vector<MeshOpening>& openings,
                        int inlet, const TracingOptions& options) {
    return VoxelTracer(open, openings, inlet, options).run();
}

}  // namespace anatomy
