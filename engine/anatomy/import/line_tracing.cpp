#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "engine/anatomy/import/branch_tree.h"
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
        std::reverse(path.begin(), path.end());
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
            const bool near = std::any_of(taken.begin(), taken.end(), [&](int node) {
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

}  // namespace

TracedLumen trace_lines(const geometry::TriangleMesh& open, const std::vector<MeshOpening>& openings,
                        int inlet, const std::vector<Polyline>& lines, const TracingOptions& options) {
    return LineTracer(open, openings, inlet, lines, options).run();
}

}  // namespace anatomy
