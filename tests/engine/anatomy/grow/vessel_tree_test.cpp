#include "engine/anatomy/grow/vessel_tree.h"

#include <algorithm>
#include <cmath>

#include "engine/anatomy/grow/vessel_presets.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using test::refusal, test::small_tree;

double length(const SampledBranch& branch) {
    return branch.step() * static_cast<double>(branch.points.size() - 1);
}

/// The error that growing the small tree reports after `change`.
template <class Change>
std::string refusal_of_tree(Change&& change) {
    VesselTreeSpec spec = small_tree();
    change(spec);
    return refusal([&] { grow(spec); });
}

}  // namespace

TEST(VesselTree, PassesThroughItsKnotsWithTheirRadii) {
    const VesselTreeSpec spec = small_tree();
    const VesselTree tree = grow(spec);
    ASSERT_EQ(tree.branches.size(), 2u);
    for (std::size_t b = 0; b < 2; ++b) {
        const SampledBranch& branch = tree.branches[b];
        const geometry::Vec3 origin =
            b == 0 ? geometry::Vec3::Zero() : tree.branches[0].points[branch.parent_sample];
        for (const VesselKnot& knot : spec.branches[b].knots) {
            double least = 1e9, radius = 0;
            for (std::size_t i = 0; i < branch.points.size(); ++i) {
                const double distance = (branch.points[i] - origin - knot.place).norm();
                if (distance < least) least = distance, radius = branch.radii[i];
            }
            EXPECT_LE(least, 0.51 * branch.step());
            EXPECT_NEAR(radius, knot.radius, 0.02);
        }
        EXPECT_LE(*std::max_element(branch.radii.begin(), branch.radii.end()), b == 0 ? 2 : 1.2);
    }
    EXPECT_EQ(tree.branches[1].points.front(), tree.branches[0].points[tree.branches[1].parent_sample]);
}

TEST(VesselTree, SamplesAreEquallyFarApart) {
    for (const SampledBranch& branch : grow(vessel_preset("lca")).branches) {
        for (std::size_t i = 1; i < branch.points.size(); ++i)
            EXPECT_NEAR((branch.points[i] - branch.points[i - 1]).norm(), branch.step(),
                        0.02 * branch.step());
    }
}

TEST(VesselTree, StenosisNarrowsTheDiameterByItsPercentAndNothingElse) {
    VesselTreeSpec spec = small_tree();
    const VesselTree whole = grow(spec);
    spec.stenoses = {{"main", 22, 6, 50}};
    const VesselTree narrowed = grow(spec);
    const SampledBranch &a = whole.branches[0], &b = narrowed.branches[0];
    const int middle = b.sample_at(22);
    EXPECT_NEAR(b.radii[middle] / a.radii[middle], 0.5, 0.02);
    for (int i = 0; i < static_cast<int>(a.points.size()); ++i) {
        EXPECT_EQ(a.points[i], b.points[i]);
        if (std::abs(i * b.step() - 22) > 3) {
            EXPECT_EQ(a.radii[i], b.radii[i]);
        }
    }
}

TEST(VesselTree, TortuosityLengthensABranchBetweenTheSameEnds) {
    VesselTreeSpec spec = small_tree();
    const VesselTree straight = grow(spec);
    spec.tortuosities = {{"main", 0.8, 12}};
    const VesselTree wavy = grow(spec);
    EXPECT_GT(length(wavy.branches[0]), 1.02 * length(straight.branches[0]));
    EXPECT_LT((wavy.branches[0].points.back() - straight.branches[0].points.back()).norm(), 1e-9);
    EXPECT_EQ(wavy.branches[1].points.front(), wavy.branches[0].points[wavy.branches[1].parent_sample]);
}

TEST(VesselTree, AneurysmIsAClosedBranchOfItsDiameter) {
    VesselTreeSpec spec = small_tree();
    spec.aneurysms = {{"main", 22, 5, 3, 0}};
    const VesselTree tree = grow(spec);
    const SampledBranch& sac = tree.branches.back();
    EXPECT_EQ(sac.name, "main aneurysm");
    EXPECT_TRUE(sac.closed);
    EXPECT_NEAR(sac.radii.back(), 2.5, 1e-12);
    // The sphere is as wide as the neck where the wall of the branch is.
    const double out = (sac.points.back() - sac.points.front()).norm(),
                 wall = tree.branches[0].radii[sac.parent_sample];
    EXPECT_NEAR(std::hypot(out - wall, 1.5), 2.5, 1e-9);
}

TEST(VesselTree, RefusesWhatCannotBeAVessel) {
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[1].parent = "nobody"; }),
                      "'side': its parent 'nobody'");
    test::expect_said(refusal_of_tree([](auto& s) {
                          for (auto& k : s.branches[1].knots) k.place.y() += 20;
                      }),
                      "'side' starts 20.00 mm from its place on 'main'");
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[1].name = "main"; }),
                      "two branches are named 'main'");
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[0].knots[1].radius = -1; }),
                      "a radius of -1 mm was found");
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[0].knots[1].radius = std::nan(""); }),
                      "a radius of nan mm");
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[0].knots[1].place.x() = 1e9; }),
                      "coordinates within");
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[0].knots.resize(1); }),
                      "has 1 points; two or more");
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[1].at = 40; }),
                      "is 40 mm along 'main'; 0 to 30.0 mm");
    test::expect_said(refusal_of_tree([](auto& s) { s.branches[1].knots[0].radius = 3; }),
                      "starts with a radius of 3.00 mm");
    test::expect_said(refusal_of_tree([](auto& s) {
                          s.stenoses = {{"man", 5, 5, 50}};
                      }),
                      "(is 'main' meant?)");
    test::expect_said(refusal_of_tree([](auto& s) { s.stenoses = {{"main", 5, 5, 99}}; }), "0 to 90 percent");
    test::expect_said(refusal_of_tree([](auto& s) {
                          s.branches.clear();
                          s.targets.clear();
                      }),
                      "there is no branch");
}

TEST(VesselTree, NamesBranchesThatBendTooTightlyOrRunThroughOneAnother) {
    test::expect_said(refusal_of_tree([](auto& s) {
                          s.branches[0].knots[1].place = {15, 12, 0};
                          s.branches[0].knots[2].place = {14, 0, 1};
                      }),
                      "branch 'main' bends with a radius of");
    test::expect_said(refusal_of_tree([](auto& s) {
                          s.branches[1].knots = {{{0, 0, 0}, 1}, {{10, 0.5, 0}, 1}};
                      }),
                      "branch 'side' never leaves 'main'");
    const VesselKnot start{{0, 0, 0}, 1}, up{{2, 8, 0}, 1}, back{{8, 8, 0}, 1}, down{{10, 0, 0}, 1};
    test::expect_said(refusal_of_tree([&](auto& s) {
                          s.branches[1].knots = {start, up, back, down};
                      }),
                      "branch 'side' runs into branch 'main'");
    test::expect_said(
        refusal_of_tree([&](auto& s) {
            s.branches.push_back(
                {"other", "main", 20, {{{0, 0, 0}, 1}, {{-2, 6, 1}, 1}, {{-8, 10, 1}, 1}}, false});
        }),
        "branch 'other' runs into branch 'side'");
}

TEST(VesselTree, OfEveryPresetCanBeGrownForManySeeds) {
    for (const VesselPreset& preset : vessel_presets()) {
        for (const std::uint64_t seed : {0, 1, 2, 3, 4}) {
            const VesselTreeSpec spec = vessel_preset(preset.name, seed),
                                 again = vessel_preset(preset.name, seed);
            EXPECT_FALSE(spec.targets.empty());
            for (std::size_t b = 0; b < spec.branches.size(); ++b)
                for (std::size_t k = 0; k < spec.branches[b].knots.size(); ++k)
                    EXPECT_EQ(spec.branches[b].knots[k].place, again.branches[b].knots[k].place);
        }
    }
}

TEST(VesselTree, OfAnUnknownPresetIsRefusedWithTheNearest) {
    test::expect_said(refusal([] { vessel_preset("arch-4"); }),
                      "'arch-4' is not a preset (is 'arch-1' meant?); presets are: arch-1");
}

TEST(VesselTree, ArchTypesDifferByTheDropOfTheTrunk) {
    const auto drop = [](const char* name) {
        const VesselTree tree = grow(vessel_preset(name));
        double top = 0;
        for (const geometry::Vec3& p : tree.branches[0].points) top = std::max(top, p.z());
        return (top - tree.branches[1].points[0].z()) / (2 * tree.branches[3].radii[0]);  // in LCCA diameters
    };
    EXPECT_LT(drop("arch-1"), 1);
    EXPECT_GT(drop("arch-2"), 1);
    EXPECT_LT(drop("arch-2"), 2);
    EXPECT_GT(drop("arch-3"), 2);
}

}  // namespace anatomy
