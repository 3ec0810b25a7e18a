#pragma once
/// A stretch of a branch in which the lumen is narrow, or may become so: what plaque, spasm, thrombus and
/// dissection have in common.

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/blood/blood_flow.h"
#include "physics/geometry/polyline.h"
#include "physics/wall/narrowed_wall.h"

namespace exercise {

/// A branch by the way from its origin.
struct BranchArc {
    const geometry::CentrelineBranch& branch;
    std::vector<double> arcs;  // of its samples [mm]
    double length;             // [mm]

    BranchArc(const anatomy::Anatomy& anatomy, int b)
        : branch(anatomy.branches[static_cast<std::size_t>(b)]),
          arcs(geometry::arc_lengths(branch.points, -anatomy::origin_of(anatomy, b))),
          length(arcs.back()) {}
    /// The sample before and the fraction of the step to the next.
    std::pair<std::size_t, double> at(double s) const {
        const auto after = std::upper_bound(arcs.begin() + 1, arcs.end() - 1, s);
        const auto i = static_cast<std::size_t>(after - arcs.begin()) - 1;
        const double step = arcs[i + 1] - arcs[i];
        return {i, step > 0 ? std::clamp((s - arcs[i]) / step, 0.0, 1.0) : 0.0};
    }
    /// Where it begins: past the mouth of its parent, in which its axis has another vessel's wall [mm].
    double begin() const {
        constexpr double mouth = 0.5;  // of the radius [-]
        return branch.parent < 0 ? arcs.front() : mouth * radius(0);
    }
    geometry::Vec3 point(double s) const {
        const auto [i, t] = at(s);
        return (1 - t) * branch.points[i] + t * branch.points[i + 1];
    }
    double radius(double s) const {
        const auto [i, t] = at(s);
        return (1 - t) * branch.radii[i] + t * branch.radii[i + 1];
    }
};

/// Samples along a branch, physics::Narrowing::spacing apart, and 4 mm beyond both ends of the stretch.
struct BranchStretch {
    static constexpr double uneven = 1.5;  // a vessel's wall lies within so many of its radii [-]

    std::vector<geometry::Vec3> axis;   // on the centreline [mm]
    std::vector<geometry::Vec3> along;  // unit
    /// Unit, across the branch: the side that a flap leaves free, seen in profile from the front.
    std::vector<geometry::Vec3> side;
    std::vector<double> arc;          // from the branch's origin [mm]
    std::vector<double> lumen, open;  // radii: of the vessel, and of a tube that touches nothing [mm]
    std::vector<double> shape;        // 1 where it is to be closed as far as asked, 0 past it
    double from = 0, to = 0;          // its ends, from the branch's origin [mm]

    /// A sample of a tube that leaves the lumen open there, at `closed` = 0, or narrows it to a radius, at 1.
    physics::Narrowing::Sample sample(std::size_t k, double narrow, double closed) const;
    /// What a lumen of these radii [mm] does to the flow: Poiseuille's law along it, and what the jet behind
    /// its narrowest place loses (Young and Tsai 1973).
    blood::Obstruction obstruction(int branch, std::span<const double> radii) const;
};

/// The problem with a stretch of `over`, half of it on either side of `at`; empty where there is none.
/// `what`: to be there, in the message.
std::string stretch_problem(const anatomy::Anatomy&, const std::string& branch, double at, double over,
                            std::string_view what);
std::string unknown_branch(const std::string& name, const anatomy::Anatomy&);
/// Of the place on a branch that is nearest to a point, from the branch's origin [mm].
double arc_on_branch(const anatomy::Anatomy&, int branch, const geometry::Vec3&);
/// Without a stretch_problem(). What would be in the mouth of the branch's parent is left out.
BranchStretch stretch_of(const anatomy::Anatomy&, int branch, double at, double over);

}  // namespace exercise
