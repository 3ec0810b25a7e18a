#include "engine/scenario/model_choice.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

using namespace anatomy;

using namespace scenario;

namespace {

constexpr double tolerance = 0.05;  // [mm]

Anatomy tube(double radius, std::vector<PenMove> path) {
    return tube_anatomy("tube", draw(path), radius, 24, radius / 2);
}

Device catalogue_device(const char* name) {
    return load_device(find_device(name, test::asset("devices")));
}

Device straight_tip() {
    Device wire;
    wire.outer_diameter = 0.36;
    return wire;
}

TEST(ModelChoice, AShaftWindsUpWhereABendCanTwistIt) {
    Device wire = catalogue_device("glide035");
    physics::stiffen(wire);
    wire.friction = 0;
    const anatomy::Anatomy bend = tube(3, {anatomy::Run{40}, anatomy::Arc{20, 1.5}, anatomy::Run{40}});
    const anatomy::Anatomy line = tube(3, {anatomy::Run{100}});
    EXPECT_FALSE(choose_model(bend, wire, tolerance, true).winds_up);
    EXPECT_EQ(choose_model(bend, wire, tolerance, true).torsion_reason, "");
    test::set_torsion(wire, 188);
    EXPECT_TRUE(choose_model(bend, wire, tolerance, true).winds_up);
    EXPECT_FALSE(choose_model(line, wire, tolerance, true).winds_up);
    EXPECT_NE(choose_model(bend, wire, tolerance, true).torsion_reason, "");
    EXPECT_FALSE(choose_model(bend, wire, tolerance, true).held_back);
    wire.friction = 0.1;
    EXPECT_TRUE(choose_model(bend, wire, tolerance, true).held_back);
    EXPECT_FALSE(choose_model(line, wire, tolerance, true).held_back);
    wire.friction = 1e-6;
    EXPECT_FALSE(choose_model(bend, wire, tolerance, true).held_back);
    set_stiffness(wire, {250, 1, 50, 50, 1e5});
    wire.length = 300;
    EXPECT_FALSE(choose_model(bend, wire, tolerance, true).winds_up);
}

}  // namespace

TEST(ModelChoice, MeasuresTheNarrowestPlaceAndTheSharpestBend) {
    const LumenDemand demand = demand_of(
        tube(1.5, {anatomy::Run{30}, Arc{8, 3.0}, anatomy::Run{30}, Arc{6, -2.4}, anatomy::Run{30}}));
    EXPECT_NEAR(demand.smallest_radius, 1.5, 1e-9);
    EXPECT_NEAR(demand.largest_curvature, 1.0 / 6, 0.02 / 6);
    EXPECT_EQ(demand.sharpest, "tube");
}

TEST(ModelChoice, ASegmentSagsByNoMoreThanTheToleranceInTheSharpestBend) {
    for (const double radius : {6.0, 12.0, 40.0}) {
        const ModelChoice choice = choose_model(
            tube(5, {anatomy::Run{40}, Arc{radius, 2.0}, anatomy::Run{40}}), straight_tip(), tolerance, true);
        EXPECT_LE(choice.segment_length * choice.segment_length / (8 * radius), tolerance * 1.05);
        EXPECT_GE(choice.segment_length * choice.segment_length / (8 * radius), tolerance * 0.8);
        test::expect_said(choice.segment_reason, "bends");
    }
}

TEST(ModelChoice, ASegmentIsNoLongerThanTheSmallestRadius) {
    const ModelChoice choice = choose_model(tube(0.7, {anatomy::Run{60}}), straight_tip(), tolerance, false);
    EXPECT_NEAR(choice.segment_length, 0.7, 1e-9);
    test::expect_said(choice.segment_reason, "narrows");
    EXPECT_TRUE(choice.demand.sharpest.empty());
}

TEST(ModelChoice, AStraightWideTubeTakesTheLongestSegments) {
    EXPECT_EQ(choose_model(tube(9, {anatomy::Run{200}}), straight_tip(), tolerance, true).segment_length,
              5.0);
}

TEST(ModelChoice, TheCurvedTipIsAWholeNumberOfSegmentsThatFollowIt) {
    for (const char* name : {"floppy014", "standard014", "v18", "glide035", "rosen035"}) {
        const Device wire = catalogue_device(name);
        const double length =
            choose_model(tube(9, {anatomy::Run{200}}), wire, tolerance, true).segment_length;
        const double count = physics::shaped_length(wire) / length, radius = 1 / largest_curvature(wire);
        EXPECT_NEAR(count, std::round(count), 1e-9) << name;
        EXPECT_LE(length * length / (8 * radius), tolerance) << name;
    }
}

TEST(ModelChoice, TakesTheWallThatTheAnatomyAllows) {
    const Anatomy wide = tube(2, {anatomy::Run{60}}), narrow = tube(0.2, {anatomy::Run{60}});
    const Anatomy huge = tube(40, {anatomy::Run{400'000}});
    EXPECT_EQ(choose_model(wide, straight_tip(), tolerance, true).wall, WallModel::Analytic);
    EXPECT_EQ(choose_model(wide, straight_tip(), tolerance, false).wall, WallModel::DistanceField);
    EXPECT_EQ(choose_model(narrow, straight_tip(), tolerance, false).wall, WallModel::Auto);
    const Anatomy tight = tube(0.27, {anatomy::Run{60}});  // a stenosis that a wire of 0.014 in just passes
    EXPECT_EQ(choose_model(tight, straight_tip(), tolerance, false).wall, WallModel::DistanceField);
    EXPECT_EQ(choose_model(huge, straight_tip(), tolerance, false).wall, WallModel::Auto);
    Device thick = straight_tip();
    thick.outer_diameter = 3;
    EXPECT_EQ(choose_model(wide, thick, tolerance, false).wall, WallModel::DistanceField);
}

TEST(ModelChoice, ChoosesForTheIliacArteriesWithReasons) {
    const Anatomy& iliac = test::iliac_renal();
    const ModelChoice choice = choose_model(iliac, catalogue_device("glide035"), tolerance, false);
    EXPECT_EQ(choice.wall, WallModel::DistanceField);
    EXPECT_GT(choice.segment_length, 0.5);
    EXPECT_LE(choice.segment_length, choice.demand.smallest_radius);
    EXPECT_FALSE(choice.segment_reason.empty());
    EXPECT_FALSE(choice.wall_reason.empty());
    const bool names_a_branch = std::any_of(
        iliac.branches.begin(), iliac.branches.end(),
        [&](const auto& branch) { return choice.wall_reason.find(branch.name) != std::string::npos; });
    EXPECT_TRUE(names_a_branch) << choice.wall_reason;
}
