#include "engine/studies/patient_figures.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "physics/geometry/vec.h"

namespace studies {
namespace {

using anatomy::SampledBranch;
using anatomy::Sex;
using anatomy::VesselTree;
using geometry::Vec3;

constexpr std::optional<anatomy::Sex> both;

/// The branch that has this vessel as one of its parts.
const SampledBranch& with_part(const VesselTree& tree, const std::string& part) {
    for (const SampledBranch& branch : tree.branches)
        if (("+" + branch.name + "+").find("+" + part + "+") != std::string::npos) return branch;
    throw std::logic_error("no branch has the part " + part);
}
double at(const SampledBranch& branch, double arc) {
    return 2 * branch.radii[branch.sample_at(arc)];
}
double start(const VesselTree& tree, const std::string& part) {
    return 2 * with_part(tree, part).radii.front();
}
double end(const VesselTree& tree, const std::string& part) {
    return 2 * with_part(tree, part).radii.back();
}
double middle(const VesselTree& tree, const std::string& part) {
    const SampledBranch& branch = with_part(tree, part);
    return 2 * branch.radii[branch.radii.size() / 2];
}
/// Where a branch leaves its parent [mm].
double origin(const VesselTree& tree, const std::string& part) {
    const SampledBranch& branch = with_part(tree, part);
    return branch.parent_sample * tree.branches[branch.parent].step();
}
double length_between(const VesselTree& tree, const std::string& from, const std::string& to) {
    return origin(tree, to) - origin(tree, from);
}
/// Angle between a branch and the way on of its parent, as far as `reach` outside [deg, mm].
double take_off(const VesselTree& tree, const std::string& part, double reach) {
    const SampledBranch& branch = with_part(tree, part);
    const SampledBranch& parent = tree.branches[branch.parent];
    const int last = static_cast<int>(branch.points.size()) - 1;
    const int to = std::min(last, branch.exit + static_cast<int>(std::lround(reach / branch.step())));
    const Vec3 away = (branch.points[to] - branch.points[0]).normalized();
    const double cosine = away.dot(parent.tangent(branch.parent_sample));
    return std::acos(std::clamp(cosine, -1.0, 1.0)) / geometry::degree;
}
/// Between the feet of the arch, where the descending aorta is as low as the ascending one's middle [mm].
double arch_width(const VesselTree& tree) {
    const SampledBranch& aorta = tree.branches[0];
    double width = 0;
    for (const Vec3& p : aorta.points) {
        Vec3 across = p - aorta.points[0];
        across.z() = 0;
        if (p.z() > aorta.points[0].z()) width = std::max(width, across.norm());
    }
    return width;
}

const PublishedFigure figure_list[] = {
    {"arch-1", "ascending aorta [mm]", 34.6, 4.7, both, "Yan, CT of 217",
     [](const VesselTree& t) { return at(t.branches[0], 40); }},
    {"arch-1", "brachiocephalic trunk [mm]", 12.5, 2.0, both, "Yan",
     [](const VesselTree& t) { return start(t, "brachiocephalic"); }},
    {"arch-1", "left common carotid [mm]", 8.3, 1.5, both, "Yan",
     [](const VesselTree& t) { return start(t, "LCCA"); }},
    {"arch-1", "left subclavian [mm]", 10.4, 2.2, both, "Yan",
     [](const VesselTree& t) { return start(t, "LSA"); }},
    {"arch-1", "internal carotid [mm]", 4.7, 0.7, both, "Baz 2021; spread estimated",
     [](const VesselTree& t) { return end(t, "LICA"); }},
    {"arch-1", "arch's plane from sagittal [deg]", 50, 14, both, "Yan",
     [](const VesselTree& t) {
         const SampledBranch& aorta = t.branches[0];
         const auto higher = [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); };
         const auto top = std::max_element(aorta.points.begin(), aorta.points.end(), higher);
         const auto i = static_cast<int>(top - aorta.points.begin());
         const Vec3 along = aorta.tangent(i);
         return std::atan2(along.x(), along.y()) / geometry::degree;
     }},
    {"arch-1", "arch's width [mm]", 80, 8, both, "estimate", arch_width},
    {"arch-arms", "axillary artery [mm]", 6.0, 1.1, both, "Arnett 2018, CT of 208",
     [](const VesselTree& t) { return at(with_part(t, "Raxillary"), origin(t, "RVA") + 116); }},
    {"arch-arms", "radial artery of men [mm]", 2.68, 0.4, Sex::Male, "Wahood 2022; spread Yoo 2005",
     [](const VesselTree& t) { return end(t, "Rradial"); }},
    {"arch-arms", "radial artery of women [mm]", 2.27, 0.34, Sex::Female, "Wahood 2022; spread Yoo 2005",
     [](const VesselTree& t) { return end(t, "Rradial"); }},
    {"lca", "left main of men [mm]", 4.5, 0.5, Sex::Male, "Dodge 1992",
     [](const VesselTree& t) { return start(t, "LM"); }},
    {"lca", "left main of women [mm]", 4.1, 0.45, Sex::Female, "Dodge 1992: −9 %",
     [](const VesselTree& t) { return start(t, "LM"); }},
    {"lca", "distal LAD of men [mm]", 1.9, 0.4, Sex::Male, "Dodge 1992",
     [](const VesselTree& t) { return end(t, "LAD"); }},
    {"lca", "circumflex of men [mm]", 3.4, 0.5, Sex::Male, "Dodge 1992",
     [](const VesselTree& t) { return start(t, "LCX"); }},
    {"lca", "LAD and circumflex [deg]", 63, 19, both, "Moon 2018, CT of 201; spread Heart Res Open J 2016",
     [](const VesselTree& t) { return take_off(t, "LCX", 8); }},
    {"rca", "right coronary of men [mm]", 3.9, 0.6, Sex::Male, "Dodge 1992",
     [](const VesselTree& t) { return start(t, "RCA"); }},
    {"iliac-renal", "infrarenal aorta of men [mm]", 16.5, 1.6, Sex::Male, "16.5 and 14.5; spread Kim 2022",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "RCIA") - 4); }},
    {"iliac-renal", "infrarenal aorta of women [mm]", 14.4, 1.5, Sex::Female,
     "16.5 and 14.5; spread Kim 2022",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "RCIA") - 4); }},
    {"iliac-renal", "common iliac of men [mm]", 9.7, 1.4, Sex::Male, "9.7 and 8.5; spread Kim 2022",
     [](const VesselTree& t) { return at(with_part(t, "RCIA"), origin(t, "RIIA") - 40); }},
    {"iliac-renal", "common femoral of men [mm]", 8.5, 1.1, Sex::Male, "Sandgren 1999; spread estimated",
     [](const VesselTree& t) { return end(t, "LCFA"); }},
    {"iliac-renal", "common femoral of women [mm]", 7.9, 1.0, Sex::Female, "Sandgren 1999; spread estimated",
     [](const VesselTree& t) { return end(t, "LCFA"); }},
    {"iliac-renal", "left renal [mm]", 5.6, 0.7, both, "CT of 202; spread estimated",
     [](const VesselTree& t) { return start(t, "LRA"); }},
    {"iliac-renal", "superior mesenteric [mm]", 5.9, 0.9, both, "5.9; spread estimated",
     [](const VesselTree& t) { return start(t, "SMA"); }},
    {"iliac-renal", "coeliac trunk [mm]", 5.9, 0.9, both, "5.9; spread estimated",
     [](const VesselTree& t) { return start(t, "coeliac"); }},
    {"iliac-renal", "inferior mesenteric [mm]", 3.1, 0.47, both, "3.1; spread estimated",
     [](const VesselTree& t) { return start(t, "IMA"); }},
    {"iliac-renal", "coeliac to superior mesenteric [mm]", 15.7, 2.9, both, "PMID 23262554; spread estimated",
     [](const VesselTree& t) { return length_between(t, "coeliac", "SMA"); }},
    {"iliac-renal", "angle of the superior mesenteric [deg]", 50, 16, both, "Jang 2002",
     [](const VesselTree& t) { return take_off(t, "SMA", 4); }},
    {"femoral", "superficial femoral of men [mm]", 6.3, 0.75, Sex::Male, "6.3 and 6.0; spread estimated",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "LPFA") + 60); }},
    {"cerebral", "cavernous carotid [mm]", 5.0, 0.6, both, "Rai 2013",
     [](const VesselTree& t) { return start(t, "ICA"); }},
    {"cerebral", "M1 [mm]", 3.1, 0.4, both, "Rai 2013",
     [](const VesselTree& t) { return at(t.branches[0], 0.5 * (origin(t, "A1") + origin(t, "M2inf"))); }},
    {"cerebral", "M2 [mm]", 2.4, 0.4, both, "Rai 2013",
     [](const VesselTree& t) { return at(t.branches[0], origin(t, "M2inf") + 6.6); }},
    {"circle", "A1 [mm]", 2.09, 0.27, both, "Shatri 2017, MRA",
     [](const VesselTree& t) { return at(with_part(t, "LA1"), 8); }},
    {"circle", "anterior communicating [mm]", 1.5, 0.22, both, "Shatri 2017",
     [](const VesselTree& t) { return middle(t, "ACOM"); }},
    {"circle", "posterior communicating [mm]", 1.22, 0.2, both, "Shatri 2017",
     [](const VesselTree& t) { return middle(t, "LPCOM"); }},
    {"circle", "P1 [mm]", 2.1, 0.35, both, "Shatri 2017, Rai 2013",
     [](const VesselTree& t) { return at(with_part(t, "RP1"), 6); }},
    {"circle", "basilar [mm]", 3.3, 0.5, both, "Rai 2013, Shatri 2017",
     [](const VesselTree& t) { return at(with_part(t, "BA"), origin(t, "LSCA") - 12); }},
    {"circle", "vertebral [mm]", 3.9, 0.8, both, "Rai 2013",
     [](const VesselTree& t) { return start(t, "LVA"); }},
    {"circle", "length of posterior communicating [mm]", 12.9, 0.9, both, "Shatri 2017",
     [](const VesselTree& t) {
         const SampledBranch& b = with_part(t, "LPCOM");
         return (b.entry - b.exit) * b.step();
     }},
};

}  // namespace

std::span<const PublishedFigure> published_figures() {
    return figure_list;
}

}  // namespace studies
