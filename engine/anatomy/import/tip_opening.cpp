#include "engine/anatomy/import/tip_opening.h"

#include <algorithm>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/import/mesh_cut.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

using geometry::CentrelineBranch;

/// A wire's radius and a little more, so that a vessel cut across still holds the wire.
constexpr double wire_margin = 1.05;
/// A blind vessel is cut where it has this part of its width near the tip.
constexpr double full_width = 0.8;
/// The end of a tube keeps this part of its width over this way from the tip, in radii; a sac has a neck.
constexpr double tube_width = 0.6, tube_length = 3;
/// A surface that cannot be cut at one place is tried again this much farther from the tip, in radii.
constexpr int tries = 5;
constexpr double retreat = 0.3;
/// A rim that reaches farther than this from the centreline, in radii, is that of an oblique cut.
constexpr double widest_rim = 2;

/// The way along a branch from its tip.
class TipWay {
public:
    TipWay(const CentrelineBranch& branch, const VesselTip& tip)
        : branch_(branch), last_(static_cast<int>(branch.points.size()) - 1), from_start_(tip.at_start) {}

    int count() const { return last_ + 1; }
    int sample(int i) const { return from_start_ ? i : last_ - i; }
    double radius(int i) const { return branch_.radii[sample(i)]; }
    const geometry::Vec3& point(int i) const { return branch_.points[sample(i)]; }
    /// A place as far behind as the vessel is wide, or the last.
    int behind(int i) const {
        int at = i;
        for (double passed = 0; at + 1 < count() && (passed < 2 * radius(i) || at < i + 3);)
            passed += step(++at);
        return at;
    }
    double step(int i) const { return (point(i) - point(i - 1)).norm(); }

private:
    const CentrelineBranch& branch_;
    int last_;
    bool from_start_;
};

double widest_near(const TipWay& way) {
    double widest = way.radius(0), passed = 0;
    for (int i = 1; i < way.count() && passed < 2 * widest; ++i) {
        passed += way.step(i);
        widest = std::max(widest, way.radius(i));
    }
    return widest;
}

/// The first place with nearly the width near the tip that the thinnest wire passes; the count if none does.
int first_wide(const TipWay& way) {
    const double wanted = std::max(wire_margin * thinnest_wire_radius, full_width * widest_near(way));
    int i = 0;
    while (i < way.count() && way.radius(i) < wanted) ++i;
    return i;
}

}  // namespace

bool ends_a_tube(const std::vector<CentrelineBranch>& branches, const VesselTip& tip) {
    const CentrelineBranch* branch = &branches[tip.branch];
    const TipWay way(*branch, tip);
    const double width = widest_near(way), narrow = tube_width * width, wanted = tube_length * width;
    double passed = 0;
    bool in_dome = true;  // which is narrow too
    for (int i = 0; i < way.count() && passed < wanted; ++i) {
        if (i > 0) passed += way.step(i);
        in_dome = in_dome && way.radius(i) < narrow;
        if (!in_dome && way.radius(i) < narrow) return false;
    }
    if (branch->parent < 0) return true;
    const double room = branches[branch->parent].radii[branch->parent_sample],
                 depth = (tip.apex - way.point(0)).norm() + geometry::length_of(branch->points) - room;
    if (depth < wanted && width > room) return false;
    while (passed < wanted && branch->parent >= 0) {
        const CentrelineBranch& parent = branches[branch->parent];
        for (int i = branch->parent_sample; i >= 0 && passed < wanted; --i) {
            if (parent.radii[i] < narrow) return false;
            if (i > 0) passed += (parent.points[i] - parent.points[i - 1]).norm();
        }
        branch = &parent;
    }
    return true;
}

double width_near(const std::vector<CentrelineBranch>& branches, const VesselTip& tip) {
    return widest_near(TipWay(branches[tip.branch], tip));
}

TipOpening open_tips(geometry::TriangleMesh& mesh, const std::vector<CentrelineBranch>& branches,
                     const std::vector<VesselTip>& tips) {
    TipOpening result;
    MeshCut cut(mesh);
    for (const VesselTip& given : tips) {
        const TipWay way(branches[given.branch], given);
        VesselTip tip = given;
        int at = first_wide(way);
        if (at + 3 >= way.count()) {
            result.thin.push_back(given);
            continue;
        }
        bool done = false;
        for (int k = 0; k < tries && !done && at + 3 < way.count(); ++k) {
            tip.centre = way.point(at);
            tip.radius = way.radius(at);
            tip.outward = (way.point(at) - way.point(way.behind(at))).normalized();
            const double reach = 2 * (tip.apex - tip.centre).norm() + 3 * tip.radius;
            done = cut.beyond(tip.centre, tip.outward, tip.apex, reach, widest_rim * tip.radius);
            for (double passed = 0; passed < retreat * tip.radius && ++at < way.count();)
                passed += way.step(at);
        }
        (done ? result.opened : result.refused).push_back(done ? tip : given);
    }
    if (!result.opened.empty()) mesh = cut.result();
    return result;
}

}  // namespace anatomy
