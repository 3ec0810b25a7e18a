#include "engine/blood/blood_flow.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "engine/anatomy/grow/generator.h"
#include "engine/blood/contrast_flow.h"
#include "tests/anatomies.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"
#include "tests/engine/vessels.h"

namespace blood {
namespace {

using namespace test;

using geometry::Vec3;

const Outlet& outlet(const BloodFlow& flow, const std::string& end) {
    return *std::find_if(flow.outlets.begin(), flow.outlets.end(),
                         [&](const Outlet& at) { return at.end == end; });
}

TEST(BloodFlow, CellsHoldTheVesselsVolume) {
    const BloodFlow flow = blood_flow(straight_vessel(120, 5));
    double volume = 0;
    for (const FlowCell& cell : flow.cells) {
        volume += cell.volume;
        EXPECT_NEAR(cell.length, 1.5, 0.3);
    }
    EXPECT_NEAR(volume, std::numbers::pi * 25 * 120 / 1000, 1e-9);
}

TEST(BloodFlow, RunsFromTheWidestEndWhereverTheCentrelinesBegin) {
    // The same vessels as a wire meets them that comes in from below.
    anatomy::Anatomy upward = small_abdomen();
    std::reverse(upward.branches[0].points.begin(), upward.branches[0].points.end());
    const BloodFlow flow = blood_flow(upward), usual = blood_flow(small_abdomen());
    EXPECT_NEAR(flow.cells[0].centre.z(), 100, 1.5);
    ASSERT_EQ(flow.outlets.size(), 3u);
    for (const Outlet& out : flow.outlets) EXPECT_NEAR(out.flow, outlet(usual, out.end).flow, 1e-12);
    for (std::size_t i = 1; i < flow.cells.size(); ++i)
        EXPECT_LT(flow.cells[i].upstream, static_cast<int>(i));
}

TEST(BloodFlow, AnAuthorMayNameTheSource) {
    FlowSpec spec;
    spec.source = "LRA.out";
    const BloodFlow flow = blood_flow(small_abdomen(), spec);
    EXPECT_NEAR(flow.cells[0].centre.x(), 50, 1.5);
    EXPECT_DOUBLE_EQ(flow.sources[0].inflow, usual_flow(3));
    spec.source = "heart";
    test::expect_refusal([&] { blood_flow(small_abdomen(), spec); }, "trunk.out");
}

TEST(BloodFlow, SplitsByRadiusCubedAndWhatAnOrganAsksFor) {
    FlowSpec spec;
    spec.inflow = 40;
    const BloodFlow flow = blood_flow(small_abdomen(), spec);
    double total = 0;
    for (const Outlet& out : flow.outlets) total += out.flow;
    EXPECT_NEAR(total, 40, 1e-12);
    EXPECT_EQ(outlet(flow, "LRA.out").organ, "kidney");
    EXPECT_EQ(outlet(flow, "SMA.out").organ, "gut");
    EXPECT_NEAR(outlet(flow, "LRA.out").flow / outlet(flow, "SMA.out").flow, 4.0 / 1.8 * 27 / 8, 1e-12);
    // Equal organs: by radius alone.
    anatomy::Anatomy plain = small_abdomen();
    plain.branches[1].name = plain.branches[2].name = "other";
    const BloodFlow murray = blood_flow(plain, spec);
    EXPECT_NEAR(outlet(murray, "trunk.out").flow / outlet(murray, "SMA.out").flow, 343.0 / 8, 1e-9);
}

TEST(BloodFlow, ChildrenBeginOutsideTheirParents) {
    const BloodFlow flow = blood_flow(small_abdomen());
    for (const FlowCell& cell : flow.cells) {
        if (cell.branch == 1) {
            EXPECT_GT(cell.centre.x(), 9);
        }
        if (cell.branch == 2) {
            EXPECT_LT(cell.centre.y(), -9);
        }
    }
    const FlowCell& entry = flow.cells[flow.entry_of(1)];
    EXPECT_GT(entry.centre.x(), 9 + 2.5);
    EXPECT_LT(entry.centre.x(), 9 + 6.5);
    EXPECT_NEAR(flow.cells[flow.nearest(Vec3(30, 1, 49))].centre.x(), 30, 1);
}

TEST(BloodFlow, KeepsVolumeInEveryCellWhateverIsAdded) {
    const BloodFlow flow = blood_flow(small_abdomen());
    std::vector<double> added(flow.cells.size(), 0.0), into(added), leaving(flow.outlets.size());
    added[flow.entry_of(1)] = 12;
    added[flow.entry_of(0)] = 3;
    flow.balance(1.7, added, into, leaving);
    std::vector<double> rest = added;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        rest[i] += into[i];
        if (flow.cells[i].upstream >= 0) rest[flow.cells[i].upstream] -= into[i];
    }
    for (std::size_t o = 0; o < leaving.size(); ++o) rest[flow.outlets[o].cell] -= leaving[o];
    for (const double left : rest) EXPECT_NEAR(left, 0, 1e-12);
    EXPECT_NEAR(into[0], 1.7 * flow.sources[0].inflow, 1e-12);
}

TEST(BloodFlow, ABranchWithoutAnEndHoldsStill) {
    anatomy::Anatomy anatomy = small_abdomen();
    add_branch(anatomy, "sac", 0, {0, 0, 30}, {0, 20, 30}, 4);
    const BloodFlow flow = blood_flow(anatomy);
    const std::vector<double> through = flow.resting();
    int cells = 0;
    for (std::size_t i = 0; i < flow.cells.size(); ++i) {
        if (flow.cells[i].branch != 3) continue;
        ++cells;
        EXPECT_EQ(through[i], 0);
    }
    EXPECT_GT(cells, 5);
}

TEST(BloodFlow, TreesThatDoNotMeetHaveASourceEach) {
    anatomy::Anatomy anatomy = straight_vessel(60, 4);
    add_branch(anatomy, "other", -1, {80, 0, 0}, {80, 0, -60}, 3);
    add_end(anatomy, "other.in", {80, 0, 0}, {0, 0, 1}, 3);
    add_end(anatomy, "other.out", {80, 0, -60}, {0, 0, -1}, 2.9);
    const BloodFlow flow = blood_flow(anatomy);
    ASSERT_EQ(flow.sources.size(), 2u);
    ASSERT_EQ(flow.outlets.size(), 2u);
    EXPECT_DOUBLE_EQ(outlet(flow, "other.out").flow, usual_flow(3));
}

TEST(BloodFlow, OfTheGeneratedVesselsIsAsPublished) {
    const anatomy::Anatomy& anatomy = test::iliac_renal();
    const BloodFlow flow = blood_flow(anatomy);
    EXPECT_NEAR(flow.cells[0].centre.z(), 149, 2);
    const auto of = [&](const std::string& name) { return outlet(flow, name + ".out").flow; };
    // Common femoral 350 ± 141 ml/min; kidneys 1.0 to 1.3 l/min; infrarenal aorta 17.5 ± 5.4 ml/s (Les 2010).
    EXPECT_NEAR(of("RCIA+REIA+RCFA") * 60, 350, 141);
    EXPECT_NEAR((of("LRA") + of("RRA")) * 60, 1150, 150);
    EXPECT_NEAR(of("aorta+LCIA+LEIA+LCFA") + of("RCIA+REIA+RCFA") + of("LIIA") + of("RIIA"), 17.5, 5.4);
    EXPECT_NEAR(outlet(flow, "LRA.out").tissue, 150, 40);
}

TEST(BloodFlow, RefusesASpecWithEverythingWrongInIt) {
    FlowSpec spec;
    spec.inflow = -1;
    spec.heart_rate = std::nan("");
    spec.limit = -3;
    EXPECT_EQ(problems(spec).size(), 3u);
    EXPECT_FALSE(refusal([&] { blood_flow(small_abdomen(), spec); }).empty());
}

TEST(BloodFlow, OfTwoTreesRunsTogetherWhereTheyMeet) {
    const anatomy::Anatomy vessels = anatomy::generate(small_confluence());
    const BloodFlow flow = blood_flow(vessels);
    ASSERT_EQ(flow.outlets.size(), 2u);
    EXPECT_EQ(flow.outlets[0].end, "left.out");
    const Outlet& joint = flow.outlets[1];
    EXPECT_EQ(joint.branch, "right");
    EXPECT_EQ(joint.organ, "confluence");
    ASSERT_GE(joint.into, 0);
    ASSERT_EQ(flow.sources.size(), 2u);
    const double left = flow.sources[0].inflow, right = flow.sources[1].inflow;
    EXPECT_NEAR(left, usual_flow(1.8), 0.05);
    EXPECT_NEAR(right, usual_flow(1.2), 1e-9);
    EXPECT_NEAR(joint.flow, right, 1e-9);
    EXPECT_NEAR(flow.outlets[0].flow, left + right, 1e-9);
    const std::vector<double> rest = flow.resting();
    EXPECT_NEAR(rest[flow.nearest({5, 4, 0})], left, 1e-9);
    EXPECT_NEAR(rest[flow.nearest({38, 0, 0})], left + right, 1e-9);
    // Contrast from either side comes out of the common end, and none is lost.
    ContrastFlow contrast(vessels);
    contrast.inject({std::string("right"), 0.5, 0.5, 300});
    double seen = 0;
    for (int frame = 0; frame < 120; ++frame) {
        contrast.step(1.0 / 15);
        seen = std::max(seen, static_cast<double>(contrast.iodine()[flow.nearest({35, 0, 0})]));
        const IodineBalance balance = contrast.balance();
        EXPECT_NEAR(balance.injected, balance.drained + balance.in_vessels + balance.in_organs, 1e-6);
    }
    EXPECT_GT(seen, 20);
}

}  // namespace
}  // namespace blood
