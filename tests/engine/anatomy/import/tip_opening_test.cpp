#include <algorithm>
#include <gtest/gtest.h>

#include "engine/anatomy/import/end_choice.h"

namespace anatomy {
namespace {

using geometry::CentrelineBranch, geometry::Vec3;

/// A vessel of radius 2 along +x, and a branch that leaves it at 20 mm along +y with these radii, a sample
/// each millimetre.
std::vector<CentrelineBranch> with_branch(const std::vector<double>& radii) {
    std::vector<CentrelineBranch> branches = {{"main", -1, -1, {}, {}}, {"branch", 0, 20, {}, radii}};
    for (int i = 0; i <= 40; ++i) branches[0].points.emplace_back(i, 0, 0), branches[0].radii.push_back(2);
    for (std::size_t i = 0; i < radii.size(); ++i) branches[1].points.emplace_back(20, i, 0);
    return branches;
}

bool is_tube(const std::vector<double>& radii) {
    const auto branches = with_branch(radii);
    VesselTip tip;
    tip.branch = 1;
    tip.centre = branches[1].points.back();
    tip.apex = tip.centre + Vec3(0, radii.back(), 0);
    tip.radius = radii.back();
    return ends_a_tube(branches, tip);
}

std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

}  // namespace

TEST(TipOpening, KnowsATubeFromASac) {
    const std::vector<double> start = {2, 2};
    EXPECT_TRUE(is_tube(joined(start, std::vector<double>(12, 1.0))));
    EXPECT_TRUE(is_tube(joined(start, std::vector<double>(12, 2.0))));
    EXPECT_TRUE(is_tube(joined(joined(start, std::vector<double>(12, 2.0)), {1.5, 0.8, 0.4})));  // a dome
    EXPECT_TRUE(is_tube({2, 1.5, 1, 1, 1}));             // a short stump
    EXPECT_TRUE(is_tube({2, 1.3, 1.3, 1.5, 1.7, 1.9}));  // one that widens
    // A sac on a neck, far from its vessel and near to it, with its centreline in the middle or not.
    EXPECT_FALSE(is_tube(joined(joined(start, std::vector<double>(12, 1.0)), {2, 3, 3, 3})));
    EXPECT_FALSE(is_tube({2, 1, 1, 2, 3, 3, 3}));
    EXPECT_FALSE(is_tube({2, 1, 1, 2, 3, 3, 2, 1, 0.5}));
    // On no neck: as narrow as its vessel, or short and wider than it.
    EXPECT_FALSE(is_tube({2, 2, 3, 3.8, 3.9, 3.8}));
    EXPECT_FALSE(is_tube({2, 2, 2.2, 2.6, 2.8, 2.8}));
    EXPECT_TRUE(is_tube(joined(start, std::vector<double>(12, 2.8))));
}

TEST(TipOpening, KnowsTheTipsOfAVesselWithoutAParent) {
    auto branches = with_branch({2, 2, 2});
    VesselTip tip;
    tip.at_start = true;
    tip.apex = {-2, 0, 0};
    EXPECT_TRUE(ends_a_tube(branches, tip));
    for (int i = 0; i < 6; ++i) branches[0].radii[i] = 4;
    EXPECT_FALSE(ends_a_tube(branches, tip));
    EXPECT_EQ(width_near(branches, tip), 4);
    tip.at_start = false;
    tip.apex = {42, 0, 0};
    EXPECT_TRUE(ends_a_tube(branches, tip));
    EXPECT_EQ(width_near(branches, tip), 2);
}

}  // namespace anatomy
