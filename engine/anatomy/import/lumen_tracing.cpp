#include "engine/anatomy/import/lumen_tracing.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/anatomy/import/branch_tree.h"
#include "engine/anatomy/import/lumen_voxels.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

using geometry::CentrelineBranch;
using geometry::Polyline;
using geometry::Vec3;

/// A voxel is covered by a ball of a centreline enlarged by this factor: what lies outside is another vessel.
constexpr double cover = 1.9;
/// More spurs or tips than this are reported, not followed.
constexpr int most_tips = 60;

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
    std::vector<geometry::BoundaryLoop> loops() const {
        std::vector<geometry::BoundaryLoop> all;
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
        std::vector<RootedWay> ways;
        for (int e = 0; e < static_cast<int>(openings_.size()); ++e) {
            if (e == inlet_) continue;
            const int voxel = behind(e);
            if (!ways_.reached(voxel) || voxel == root_) {
                result_.unreached.push_back(e);
                continue;
            }
            RootedWay way{e, way_to(voxel)};
            way.points.push_back(openings_[e].loop.centroid);
            ways.push_back(std::move(way));
        }
        sort_stems_first(ways, wall_);
        for (const RootedWay& way : ways) {
            if (tree_.branches.empty())
                tree_.add_root(way.points, true, true);
            else
                tree_.add(tree_.own_part(way.points), true);
            finish(way.opening);
        }
    }

    /// To be called after a branch was added.
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
        const double width = std::max(voxels_.size(), tree_.width(own)),
                     length = geometry::length_of(own.way);
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

    /// The path to the other side where two fronts of paths have met at the tip; else empty.
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
            const double length = geometry::length_of(other.way);
            if (2 * apart < other.way.size() || length < 2 * width || length < longest) return;
            longest = length;
            best = way_to(v);
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
    VoxelWays ways_;
    std::vector<char> covered_;
    int root_ = -1;
    TracedLumen result_;
};

}  // namespace

TracedLumen trace_lumen(const geometry::TriangleMesh& open, const std::vector<MeshOpening>& openings,
                        int inlet, const TracingOptions& options) {
    return VoxelTracer(open, openings, inlet, options).run();
}

}  // namespace anatomy
