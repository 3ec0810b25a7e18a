#include "engine/anatomy/grow/vessel_tree.h"

#include <algorithm>
#include <cmath>

#include "engine/anatomy/grow/vessel_presets.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using test::small_tree;

double length(const SampledBranch& branch) {
    return branch.step() * static_cast<double>(branch.points.size() - 1);
}

/// Holds that after `change` no tree grows from the description, and what is said.
template <class Change>
void expect_no_tree(VesselTreeSpec spec, const std::string& said, Change&& change,
                    const std::source_location& where = std::source_location::current()) {
    change(spec);
    test::expect_refusal([&] { grow(spec); }, said, where);
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

TEST(VesselTree, TargetBeyondTheEndOfItsBranchIsRefusedWithTheLength) {
    for (const char* said : {"the target 'far' is 500 mm along 'side'; expected 0 to 1", " mm"})
        expect_no_tree(small_tree(), said, [](auto& s) { s.targets[0].at = 500; });
    // One that an occlusion cuts off is left out.
    VesselTreeSpec occluded = small_tree();
    occluded.occlusions = {{"side", 6}};
    EXPECT_NO_THROW(grow(occluded));
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
    expect_no_tree(small_tree(), "'side': its parent 'nobody'",
                   [](auto& s) { s.branches[1].parent = "nobody"; });
    expect_no_tree(small_tree(), "'side' starts 20.00 mm from its place on 'main'", [](auto& s) {
        for (auto& k : s.branches[1].knots) k.place.y() += 20;
    });
    expect_no_tree(small_tree(), "two branches are named 'main'",
                   [](auto& s) { s.branches[1].name = "main"; });
    expect_no_tree(small_tree(), "a radius of -1 mm was found",
                   [](auto& s) { s.branches[0].knots[1].radius = -1; });
    expect_no_tree(small_tree(), "a radius of nan mm",
                   [](auto& s) { s.branches[0].knots[1].radius = std::nan(""); });
    expect_no_tree(small_tree(), "coordinates within",
                   [](auto& s) { s.branches[0].knots[1].place.x() = 1e9; });
    expect_no_tree(small_tree(), "has 1 points; expected two or more",
                   [](auto& s) { s.branches[0].knots.resize(1); });
    expect_no_tree(small_tree(), "is 40 mm along 'main'; expected 0 to 30.0 mm",
                   [](auto& s) { s.branches[1].at = 40; });
    expect_no_tree(small_tree(), "starts with a radius of 3.00 mm",
                   [](auto& s) { s.branches[1].knots[0].radius = 3; });
    expect_no_tree(small_tree(), "(did you mean 'main'?)", [](auto& s) { s.stenoses = {{"man", 5, 5, 50}}; });
    expect_no_tree(small_tree(), "0 to 90 percent", [](auto& s) { s.stenoses = {{"main", 5, 5, 99}}; });
    expect_no_tree(small_tree(), "there is no branch", [](auto& s) {
        s.branches.clear();
        s.targets.clear();
    });
}

TEST(VesselTree, NamesBranchesThatBendTooTightlyOrRunThroughOneAnother) {
    expect_no_tree(small_tree(), "branch 'main' bends with a radius of", [](auto& s) {
        s.branches[0].knots[1].place = {15, 12, 0};
        s.branches[0].knots[2].place = {14, 0, 1};
    });
    expect_no_tree(small_tree(), "branch 'side' never leaves 'main'", [](auto& s) {
        s.branches[1].knots = {{{0, 0, 0}, 1}, {{10, 0.5, 0}, 1}};
    });
    const VesselKnot start{{0, 0, 0}, 1}, up{{2, 8, 0}, 1}, back{{8, 8, 0}, 1}, down{{10, 0, 0}, 1};
    expect_no_tree(small_tree(), "branch 'side' runs into branch 'main'", [&](auto& s) {
        s.branches[1].knots = {start, up, back, down};
    });
    expect_no_tree(small_tree(), "branch 'other' runs into branch 'side'", [&](auto& s) {
        s.branches.push_back(
            {"other", "main", 20, {{{0, 0, 0}, 1}, {{-2, 6, 1}, 1}, {{-8, 10, 1}, 1}}, false});
    });
}

TEST(VesselTree, ABranchMayEndOnAnother) {
    const VesselTree tree = grow(test::small_loop());
    const SampledBranch &bypass = tree.branches[2], &main = tree.branches[0];
    EXPECT_EQ(tree.loops(), 1);
    EXPECT_EQ(bypass.joined, 0);
    EXPECT_NEAR(bypass.joined_sample * main.step(), 24, main.step());
    EXPECT_LT((bypass.points.back() - main.points[bypass.joined_sample]).norm(), 1e-9);
    const int last = static_cast<int>(bypass.points.size()) - 1;
    EXPECT_LT(bypass.exit, bypass.separation);
    EXPECT_LT(bypass.separation, bypass.approach);
    EXPECT_LT(bypass.approach, bypass.entry);
    EXPECT_LT(bypass.entry, last);
    EXPECT_EQ(grow(small_tree()).loops(), 0);
    EXPECT_EQ(grow(test::small_confluence()).loops(), 0);  // two trees that meet
}

TEST(VesselTree, RefusesAJointThatCannotBe) {
    expect_no_tree(test::small_loop(), "branch 'bypass' joins 'nobody', which is no branch listed before it",
                   [](auto& s) { s.branches[2].joins = "nobody"; });
    expect_no_tree(test::small_loop(),
                   "the end of branch 'bypass' is 90 mm along 'main'; expected 0 to 30.0 mm",
                   [](auto& s) { s.branches[2].joins_at = 90; });
    expect_no_tree(test::small_loop(), "branch 'bypass' is closed and joins 'main'",
                   [](auto& s) { s.branches[2].closed = true; });
    expect_no_tree(test::small_loop(), "branch 'bypass' ends with a radius of 2.50 mm in 'main'",
                   [](auto& s) { s.branches[2].knots.back().radius = 2.5; });
    expect_no_tree(test::small_confluence(),
                   "branch 'right' has no parent; expected one for all branches but the first",
                   [](auto& s) { s.branches[1].joins.clear(); });
    expect_no_tree(test::small_tree(), "branch 'side' is nowhere clear of 'main', which it joins",
                   [](auto& s) {
                       s.branches[1].joins = "main";
                       s.branches[1].joins_at = 16;
                       s.branches[1].knots = {{{0, 0, 0}, 1}, {{2, 1, 0}, 1}, {{4, 0, 0}, 1}};
                   });
}

TEST(VesselTree, KnotsKnowTheirArcsAndTheirTightestBend) {
    const std::vector<VesselKnot> straight = {{{0, 0, 0}, 1}, {{3, 4, 0}, 1}, {{6, 8, 0}, 1}};
    const std::vector<double> arcs = knot_arcs(straight);
    ASSERT_EQ(arcs.size(), 3u);
    EXPECT_NEAR(arcs[1], 5, 1e-9);
    EXPECT_NEAR(arcs[2], 10, 1e-9);
    EXPECT_GT(tightest_bend(straight).ratio, 1000);
    std::vector<VesselKnot> circle;
    for (int k = 0; k <= 12; ++k) circle.push_back({{8 * std::cos(0.3 * k), 8 * std::sin(0.3 * k), 0}, 2});
    // The spline turns a little more at its ends.
    EXPECT_GT(tightest_bend(circle).ratio, 3);
    EXPECT_LT(tightest_bend(circle).ratio, 4.1);
    circle[6].radius = 4;
    EXPECT_EQ(tightest_bend(circle).knot, 6u);
}

TEST(VesselTree, OfTheCircleOfWillisHasItsLoop) {
    const VesselTree tree = grow(vessel_preset("circle"));
    EXPECT_EQ(tree.loops(), 1);
    int roots = 0;
    for (const SampledBranch& branch : tree.branches) roots += branch.parent < 0;
    EXPECT_EQ(roots, 4);  // two carotids and two vertebrals
}

TEST(VesselTree, PresetsHaveTheDiametersThatAreAskedFor) {
    const auto radius = [](const VesselTreeSpec& spec, const std::string& name) {
        for (const BranchSpec& branch : spec.branches)
            if (branch.name == name) return branch.knots.front().radius;
        return 0.0;
    };
    const VesselTreeSpec abdomen = vessel_preset("iliac-renal");
    EXPECT_EQ(abdomen.branches[0].knots.back().radius, 4.25);  // common femoral, men
    EXPECT_EQ(radius(abdomen, "SMA"), 2.95);
    EXPECT_EQ(radius(abdomen, "coeliac+CHA"), 2.95);
    EXPECT_EQ(radius(abdomen, "IMA"), 1.55);
    EXPECT_GT(radius(vessel_preset("femoral"), "LPFA"), 2);
    const VesselTreeSpec arms = vessel_preset("arch-arms");
    for (const BranchSpec& branch : arms.branches) {
        if (branch.name.ends_with("radial")) {
            EXPECT_GE(branch.knots.back().radius, 1.3) << branch.name;
        }
    }
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
    test::expect_refusal([] { vessel_preset("arch-4"); },
                         "'arch-4' is not a preset (did you mean 'arch-1'?); presets are: arch-1");
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
