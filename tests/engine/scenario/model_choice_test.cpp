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

LumenDemand demand_of(const Anatomy& anatomy) {
    return Reach(anatomy).all();
}

/// What a shaft of which 400 mm are inside asks for.
physics::Torsion chosen(const Device& wire, const Anatomy& anatomy, ShaftState at = {}) {
    if (at.inserted == 0) at.inserted = 400, at.outside = 100;
    return least_torsion(torsion_need(wire, at, demand_of(anatomy)), at);
}

}  // namespace

TEST(ModelChoice, AShaftIsTheLeastThatTheBendsWithinReachAndItsFrictionAskFor) {
    using physics::Torsion;
    Device wire = catalogue_device("glide035");
    wire.friction = wire.static_friction = 0;
    const Anatomy bend = tube(3, {anatomy::Run{40}, anatomy::Arc{20, 1.5}, anatomy::Run{40}});
    const Anatomy line = tube(3, {anatomy::Run{100}});
    test::set_torsion(wire, 188);
    EXPECT_EQ(chosen(wire, bend), Torsion::Whole);
    EXPECT_EQ(chosen(wire, line), Torsion::Rigid);
    ShaftState turned{400, 100};
    turned.torque = 0.1;  // N·mm, that the chain is known to have
    EXPECT_EQ(chosen(wire, line, turned), Torsion::Whole);
    ShaftState held{400, 100};
    held.held_back = 0.1;
    EXPECT_EQ(chosen(wire, bend, held), Torsion::Whole) << "nothing holds without friction";
    wire.friction = 0.1;
    EXPECT_EQ(chosen(wire, line, held), Torsion::Segments);
    wire.friction = 1e-6;
    EXPECT_EQ(chosen(wire, bend), Torsion::Whole);
    wire.shape.clear();
    EXPECT_EQ(chosen(wire, bend, held), Torsion::Rigid) << "no turn of a straight tip shows";
    wire = catalogue_device("glide035");
    physics::stiffen(wire);
    EXPECT_EQ(chosen(wire, bend), Torsion::Rigid);
}

TEST(ModelChoice, LengthThatIsOutDoesNotWindUp) {
    const Anatomy bend = tube(3, {anatomy::Run{40}, anatomy::Arc{60, 0.5}, anatomy::Run{40}});
    Device wire = catalogue_device("glide035");
    wire.friction = wire.static_friction = 0;
    test::set_torsion(wire, 5000);
    EXPECT_EQ(chosen(wire, bend, {50, 20}), physics::Torsion::Rigid);
    EXPECT_EQ(chosen(wire, bend, {1500, 300}), physics::Torsion::Whole);
    const TorsionNeed near = torsion_need(wire, {50, 20}, demand_of(bend)),
                      far = torsion_need(wire, {1500, 300}, demand_of(bend));
    EXPECT_EQ(near.shaft, 70);
    EXPECT_GT(far.winds_up, 2 * near.winds_up);
}

TEST(ModelChoice, AModelIsLeftOnlyWhereHalfOfWhatShowsIsLeftOut) {
    using physics::Torsion;
    Device wire = catalogue_device("glide035");
    wire.friction = 0.1;
    const Anatomy line = tube(3, {anatomy::Run{100}});
    const auto next = [&](Torsion now, double held_degrees, double wound_degrees) {
        ShaftState at{400, 100, 0, held_degrees * geometry::degree, wound_degrees * geometry::degree, now};
        TorsionNeed need = torsion_need(wire, at, demand_of(line));
        need.arm = 50;  // shows by the angle alone
        return least_torsion(need, at);
    };
    EXPECT_EQ(next(Torsion::Rigid, 1.5, 0), Torsion::Rigid);
    EXPECT_EQ(next(Torsion::Rigid, 2.5, 0), Torsion::Segments);
    EXPECT_EQ(next(Torsion::Segments, 1.5, 0), Torsion::Segments);
    EXPECT_EQ(next(Torsion::Segments, 0.5, 1.5), Torsion::Whole) << "it is wound up";
    EXPECT_EQ(next(Torsion::Segments, 0.5, 0.5), Torsion::Rigid);
}

TEST(ModelChoice, SaysWhatIsLeftOut) {
    Device wire = catalogue_device("glide035");
    wire.friction = 0.1;
    const Anatomy bend = tube(3, {anatomy::Run{40}, anatomy::Arc{20, 1.5}, anatomy::Run{40}});
    const TorsionNeed need = torsion_need(wire, {400, 100, 0, 0.2}, demand_of(bend));
    EXPECT_NEAR(need.left_out(physics::Torsion::Rigid), need.winds_up + need.held_back, 1e-12);
    EXPECT_EQ(need.left_out(physics::Torsion::Whole), need.held_back);
    EXPECT_EQ(need.left_out(physics::Torsion::Segments), 0);
    EXPECT_LE(need.at_tip(100), 2 * 3 + 1e-9) << "no farther than the lumen is wide";
    test::expect_said(torsion_sentence(need, physics::Torsion::Whole), "are left out");
    TorsionNeed wide = need;
    wide.winds_up = 250.4 * geometry::degree, wide.held_back = 0;
    test::expect_said(torsion_sentence(wide, physics::Torsion::Rigid), "up to 250 degrees are left out");
    // Of what there is now, by a torque of 1 N mm at the hub.
    const TorsionNeed now = torsion_need(wire, {400, 100, -1, 0.2}, demand_of(bend));
    EXPECT_NEAR(now.winds_up_now, now.give, 1e-12);
    EXPECT_LE(now.winds_up_now, now.winds_up);
    EXPECT_EQ(torsion_sentence(need, physics::Torsion::Segments).find("left out"), std::string::npos);
}

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

TEST(ModelChoice, SegmentsAreThoseOfTheVesselsThatAreAskedFor) {
    const Anatomy narrow = tube(0.7, {anatomy::Run{60}});
    const Reach reach(narrow);
    LumenDemand wide = reach.all();
    wide.smallest_radius = 3;
    EXPECT_EQ(choose_model(narrow, reach, wide, straight_tip(), tolerance, false).segment_length, 3);
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
