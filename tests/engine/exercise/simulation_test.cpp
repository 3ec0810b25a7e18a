#include "engine/exercise/simulation.h"

#include <numeric>

#include "engine/anatomy/lumen_wall.h"
#include "tests/anatomies.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

void go(Simulation& simulation, int frames, const script::Command& command) {
    for (int i = 0; i < frames; ++i) {
        simulation.apply(command);
        simulation.step();
    }
}

std::string refusal_with(const std::string& from, const std::string& to) {
    return test::refusal([&] { Simulation simulation(test::small_scenario_with(from, to)); });
}

/// A thin wire in a vessel of radius 2 with a branch at a sharp angle: its carina lies between two joints.
scenario::Scenario bifurcation(const std::string& relaxer) {
    std::string text =
        test::small_toml_with("frictionless = true",
                              "frictionless = true\ndiameter_mm = 0.36\nshaft_rigidity_N_mm2 = 20.0\n"
                              "tip_rigidity_N_mm2 = 2.0\ntip_length_mm = 8.0\n"
                              "transition_length_mm = 10.0\ncurved_length_mm = 6.0\n"
                              "curved_angle_deg = 90.0");
    text.replace(text.find("[chain]"), 7, "[chain]\nsegment_length_mm = 2.0");
    text.replace(text.find("[relaxer]"), 9, "[relaxer]\nkind = \"" + relaxer + "\"");
    scenario::Scenario scenario = test::small_scenario(text);
    scenario.tube.reset();
    scenario.tissue.rigid = true;  // what crosses here is a segment across walls that stay
    scenario.vessels = test::small_tree();
    scenario.entry = {"main.in"};
    scenario.wire().inserted = 10;
    scenario.target = {"far", {}, 1, 0.2};
    return scenario;
}

/// Largest depth of all segments between their joints, beyond their ends' depth, from many places [mm].
double deepest_crossing(const Simulation& simulation, const physics::LumenWall& wall) {
    const physics::Chain& wire = simulation.wire();
    double deepest = 0;
    for (int i = 1; i <= wire.segments(); ++i) {
        std::vector<geometry::Vec3> places;
        for (int k = 0; k <= 50; ++k)
            places.push_back(wire.joints[i - 1] + k / 50.0 * (wire.joints[i] - wire.joints[i - 1]));
        std::vector<physics::WallContact> contacts(places.size());
        for (physics::WallContact& c : contacts) c.station = wire.stations[i];
        wall.contacts(places, contacts);
        const double ends = std::max({0.0, contacts.front().penetration, contacts.back().penetration});
        for (const physics::WallContact& c : contacts) deepest = std::max(deepest, c.penetration - ends);
    }
    return deepest;
}

int pieces(const physics::Chain& wire) {
    int count = 0;
    for (int i = 1; i <= wire.segments(); ++i) count += wire.within_a_segment(i);
    return count;
}

}  // namespace

TEST(Simulation, WireStartsInsideAlongTheEntry) {
    const Simulation simulation(test::small_scenario());
    EXPECT_EQ(simulation.wire().segments(), 10);
    EXPECT_DOUBLE_EQ(simulation.inserted(), 20.0);
    EXPECT_TRUE(simulation.wire().joints[0].isApprox(geometry::Vec3::Zero()));
    EXPECT_TRUE(physics::validate(simulation.wire()).empty());
    EXPECT_FALSE(simulation.console().beam_on());
}

TEST(Simulation, AdvanceAndWithdrawMoveTheWireByWhatIsAsked) {
    Simulation simulation(test::small_scenario());
    simulation.apply(script::Advance{5.3});
    const StepReport report = simulation.step();
    EXPECT_EQ(simulation.wire().segments(),
              13);  // 25.3 mm are 11 of 2 mm, the tip's 6 among them, and one of 1.3… mm
    EXPECT_EQ(simulation.wire().carried, 0.0);
    EXPECT_NEAR(std::accumulate(report.insertions.begin(), report.insertions.end(), 0.0), 5.3, 1e-12);
    EXPECT_NEAR(simulation.inserted(), 25.3, 1e-9);
    EXPECT_EQ(report.waiting_insertion, 0);
    simulation.apply(script::Withdraw{5.3});
    simulation.step();
    EXPECT_NEAR(simulation.inserted(), 20.0, 1e-9);
}

TEST(Simulation, SegmentRelaxersFeedWhatIsAskedFor) {
    Simulation simulation(test::small_scenario_with("[relaxer]", "[relaxer]\nkind = \"segment\""));
    simulation.apply(script::Advance{5});
    const StepReport report = simulation.step();
    EXPECT_NEAR(simulation.inserted(), 25, 1e-12);
    EXPECT_TRUE(physics::validate(simulation.wire()).empty());
    ASSERT_EQ(report.insertions.size(), 1u);
    EXPECT_NEAR(report.insertions[0], 5, 1e-12);
    simulation.apply(script::Withdraw{5});
    simulation.step();
    EXPECT_NEAR(simulation.inserted(), 20, 1e-12);
}

TEST(Simulation, WireFollowsTheBendAndStaysInTheLumen) {
    Simulation simulation(test::small_scenario());
    go(simulation, 20, script::Advance{2});
    for (const physics::WallContact& contact : simulation.contacts()) EXPECT_LT(contact.penetration, 0.3);
    EXPECT_GT(simulation.wire().tip().y(), 3.0);
    EXPECT_TRUE(physics::validate(simulation.wire()).empty());
}

TEST(Simulation, LongMotionInOneFrameStaysInTheLumenToo) {
    Simulation simulation(test::small_scenario());
    go(simulation, 1, script::Advance{40});
    for (const physics::WallContact& contact : simulation.contacts()) EXPECT_LT(contact.penetration, 0.3);
}

TEST(Simulation, ClosedFormWallLeadsTheWireAsTheMeshDoes) {
    Simulation mesh(test::small_scenario_with("[relaxer]", "[wall]\nmodel = \"mesh\"\n[relaxer]"));
    Simulation tube(test::small_scenario());
    go(mesh, 15, script::Advance{2});
    go(tube, 15, script::Advance{2});
    for (int i = 0; i < 60; ++i) mesh.step(), tube.step();
    // The mesh's chords lie up to r(1 − cos(π/96)) = 0.001 mm inside; the rest is that planes have steps, at
    // which a wire may stay: 0.145 mm here. Each part of its motion ends there, where there was one end a
    // frame before.
    EXPECT_LT((mesh.wire().tip() - tube.wire().tip()).norm(), 0.2);
}

/// However small the budget is, 20 updates being two passes over the ten segments.
TEST(Simulation, MotionThatTheBudgetDoesNotAllowIsMadeInTheFramesThatFollow) {
    for (const int budget : {20, 60, 200}) {
        scenario::Scenario scenario = test::small_scenario();
        scenario.budget.updates = budget;
        Simulation simulation(scenario);
        simulation.apply(script::Advance{30});
        simulation.apply(script::Rotate{1.0});
        simulation.apply(script::Withdraw{6});
        double advanced = 0, withdrawn = 0, turned = 0;
        StepReport report;
        for (int frame = 0; frame < 4000; ++frame) {
            report = simulation.step();
            for (const double insertion : report.insertions)
                (insertion > 0 ? advanced : withdrawn) += insertion;
            if (frame == 0) {
                EXPECT_LT(advanced, 30) << budget;
            }
            turned += report.rotation;
            for (const physics::WallContact& c : simulation.contacts()) EXPECT_LT(c.penetration, 0.3);
        }
        EXPECT_NEAR(advanced, 30, 1e-9) << budget;
        EXPECT_NEAR(turned, 1.0, 1e-12) << budget;
        EXPECT_NEAR(withdrawn, -6, 1e-9) << budget;
        EXPECT_TRUE(report.relax.converged()) << budget;
        EXPECT_TRUE(report.insertions.empty()) << budget;
    }
}

TEST(Simulation, AnIdleFrameDoesNoWork) {
    Simulation simulation(test::small_scenario());
    go(simulation, 5, script::Advance{2});
    simulation.step();
    const StepReport idle = simulation.step();
    EXPECT_TRUE(idle.relax.converged());
    EXPECT_EQ(idle.relax.updates, 0);
    EXPECT_EQ(idle.relax.wall_queries, 0);
}

TEST(Simulation, WithdrawalStopsAtTwoSegments) {
    Simulation simulation(test::small_scenario());
    simulation.apply(script::Withdraw{100});
    const StepReport report = simulation.step();
    EXPECT_TRUE(report.withdrawal_stopped);
    EXPECT_EQ(simulation.wire().segments(), 2);
    EXPECT_NEAR(simulation.inserted(), 4, 1e-9);
}

TEST(Simulation, AWireWedgesPastAnEndOfTheVessels) {
    Simulation simulation(test::small_scenario());
    EXPECT_FALSE(simulation.step().past_vessel_end);
    go(simulation, 28, script::Advance{2});  // the tube is 77 mm long, of which 20 were inside
    EXPECT_FALSE(simulation.readings().motion.past_vessel_end);
    const geometry::OpenEnd& end = simulation.anatomy().ends[1].opening;
    const double gone = 14 * end.radius + 2;  // past the closed tip
    double push = 0;
    for (int frame = 0; frame < 200; ++frame) {
        go(simulation, 1, script::Advance{2});
        const double beyond = (simulation.wire().tip() - end.centre).dot(end.outward_normal);
        EXPECT_LT(beyond, gone);
        push = std::max(push, simulation.readings().hands[0].load.push);
    }
    EXPECT_TRUE(simulation.readings().motion.past_vessel_end);
    EXPECT_GT(push, 0.2);
}

TEST(Simulation, WireStopsWhereItsLengthEnds) {
    std::string text = test::small_toml_with("run_mm = 30.0", "run_mm = 200.0");
    text.replace(text.find("[guidewire]"), 11, "[guidewire]\nlength_mm = 100");
    Simulation simulation(test::small_scenario(text));
    go(simulation, 4, script::Advance{20});
    EXPECT_NEAR(simulation.inserted(), 100, 1e-6);
    simulation.apply(script::Advance{3});
    const StepReport report = simulation.step();
    EXPECT_TRUE(report.whole_wire_is_in);
    EXPECT_NEAR(simulation.inserted(), 100, 1e-6);
    simulation.apply(script::Withdraw{10});
    simulation.apply(script::Advance{15});
    bool stopped = false;
    for (int frame = 0; frame < 6; ++frame) stopped = simulation.step().whole_wire_is_in || stopped;
    EXPECT_TRUE(stopped);
    EXPECT_NEAR(simulation.inserted(), 100, 1e-6);
}

TEST(Simulation, AdaptiveWireHasFewerSegmentsAndIsWhereTheUniformOneIs) {
    const auto tube = [](const char* chain) {
        std::string text = test::small_toml_with("run_mm = 30.0", "run_mm = 200.0");
        text.replace(text.find("inserted_mm = 20.0"), 18, "inserted_mm = 180.0");
        return test::small_scenario(text.replace(text.find("[chain]"), 7, chain));
    };
    Simulation uniform(tube("[chain]")), adaptive(tube("[chain]\nadaptive = true"));
    for (Simulation* s : {&uniform, &adaptive})
        go(*s, 20, script::Advance{2}), go(*s, 5, script::Withdraw{3});
    EXPECT_DOUBLE_EQ(adaptive.inserted(), uniform.inserted());
    EXPECT_LT(adaptive.wire().segments(), uniform.wire().segments() / 2);
    EXPECT_LT((adaptive.wire().tip() - uniform.wire().tip()).norm(), 0.05);
    EXPECT_TRUE(physics::validate(adaptive.wire()).empty());
    const auto hash = adaptive.state_hash();
    adaptive.reset();
    go(adaptive, 20, script::Advance{2}), go(adaptive, 5, script::Withdraw{3});
    EXPECT_EQ(adaptive.state_hash(), hash);
}

TEST(Simulation, ChoosesTheSegmentLengthAndKeepsTheWallAsStiffPerLength) {
    const Simulation simulation(test::small_scenario_with(
        "[chain]", "[chain]\nsegment_length_mm = \"auto\"\ncurve_tolerance_mm = 0.02"));
    const physics::Grid& wire = simulation.wire().grid;
    EXPECT_EQ(wire.segment_length, simulation.choice().segment_length);
    EXPECT_DOUBLE_EQ(wire.segment_length, 1.5);  // √(8 · 0.02 mm · 15.3 mm) = 1.56 mm, an eighth of the tip
    EXPECT_NEAR(simulation.scenario().wall_stiffness / wire.segment_length, 5.0 / 2.0, 1e-12);
    EXPECT_EQ(simulation.scenario().wall_model, scenario::WallModel::Analytic);
}

TEST(Simulation, RotationTurnsTheTip) {
    Simulation simulation(test::small_scenario());
    const geometry::Vec3 before = simulation.wire().tip();
    simulation.apply(script::Rotate{std::numbers::pi});
    EXPECT_DOUBLE_EQ(simulation.step().rotation, std::numbers::pi);
    for (int i = 0; i < 20; ++i) simulation.step();
    EXPECT_GT((simulation.wire().tip() - before).norm(), 1.0);
}

TEST(Simulation, SameCommandsReachTheSameState) {
    Simulation a(test::small_scenario()), b(test::small_scenario());
    for (Simulation* s : {&a, &b}) {
        s->apply(script::Inject{6, 6, "tube", 320});
        go(*s, 5, script::Advance{3});
        go(*s, 3, script::Rotate{0.7});
        go(*s, 2, script::Withdraw{1});
    }
    EXPECT_EQ(a.state_hash(), b.state_hash());
    go(b, 1, script::Rotate{1e-9});
    go(a, 1, script::Rotate{0});
    EXPECT_NE(a.state_hash(), b.state_hash());
}

TEST(Simulation, EveryCommandChangesTheStatesHash) {
    using namespace script;
    const Simulation fresh(test::small_scenario());
    const std::uint64_t hash = fresh.state_hash();
    const Command commands[] = {Advance{1e-3},
                                Withdraw{1e-3},
                                Rotate{1e-6},
                                Grip{120, DeviceRole::Wire},
                                Contrast{1},
                                Inject{1, 1, "tube", 320},
                                Beam{true},
                                SetMode{ImagingMode::Dsa},
                                SetPulseRate{fresh.console().pulse_rate() == 7.5 ? 3.75 : 7.5},
                                NewMask{},
                                StoreReference{},
                                ShiftMask{ShiftMask::Mode::By, 1, 0},
                                MoveArm{1e-6, {}, {}, {}, {}, {}},
                                MoveArm{{}, 1e-6, {}, {}, {}, {}},
                                MoveTable{{1e-6, 0, 0}},
                                Collimate{100, 100},
                                SetFilter{FilterKind::Wedge, {10, 0}},
                                Breathe{true},
                                Complicate{ComplicationKind::Spasm, "tube", 40, 10, 50},
                                Complicate{ComplicationKind::Breath, "", 0, 0, 0, BreathManner::Cough}};
    for (const Command& command : commands) {
        Simulation changed(fresh);
        EXPECT_EQ(changed.state_hash(), hash);
        changed.apply(command);
        EXPECT_NE(changed.state_hash(), hash) << to_text(command);
    }
}

TEST(Simulation, ResetEqualsAFreshLoad) {
    Simulation used(test::small_scenario()), fresh(test::small_scenario());
    const std::uint64_t at_start = used.state_hash();
    used.apply(script::MoveArm{0.2, {}, {}, {}, {}, {}});
    used.apply(script::Beam{true});
    used.apply(script::Contrast{10});
    used.apply(script::Inject{6, 6, "tube", 320});
    go(used, 7, script::Advance{3});
    EXPECT_NE(used.state_hash(), at_start);
    used.apply(script::Reset{});
    EXPECT_EQ(used.state_hash(), at_start);
    EXPECT_TRUE(used.step().reset);
    EXPECT_FALSE(fresh.step().reset);
    go(used, 5, script::Advance{2.5});
    go(fresh, 5, script::Advance{2.5});
    EXPECT_EQ(used.state_hash(), fresh.state_hash());
}

TEST(Simulation, StartsAndTargetsThatCannotBeAreRefusedWithThoseThereAre) {
    const std::string end = refusal_with("end = \"start\"", "end = \"groin\"");
    test::expect_said(end, "small.toml:10:");
    test::expect_said(end, "start, end");
    test::expect_said(refusal_with("name = \"end\"", "name = \"heart\""), "targets are: end");
    const std::string outside = refusal_with("name = \"end\"", "centre_mm = [0.0, 50.0, 0.0]");
    test::expect_said(outside, "outside the anatomy");
    test::expect_said(outside, "small.toml:");
    for (const char* inserted : {"inserted_mm = 500.0", "inserted_mm = 3.9"})
        test::expect_said(refusal_with("inserted_mm = 20.0", inserted), "cannot start inside");
}

TEST(Simulation, SegmentsAcrossACarinaGetAJointThereAndLoseItAgain) {
    Simulation simulation(bifurcation("global"), test::cache());
    const auto wall = anatomy::cached_distance_field(simulation.anatomy(), 5, 0.18, test::cache());
    int with_pieces = 0;
    const auto into_the_branch = [&](double roll) {
        go(simulation, 1, script::Rotate{roll});
        for (int frame = 0; frame < 28; ++frame) {
            simulation.apply(script::Advance{0.5});
            EXPECT_EQ(simulation.step().deepest_crossing, 0);
            EXPECT_LT(deepest_crossing(simulation, *wall), 0.106);
            EXPECT_TRUE(physics::validate(simulation.wire()).empty());
            with_pieces += pieces(simulation.wire()) > 0;
        }
        EXPECT_NEAR(simulation.inserted(), 24, 1e-9);
        go(simulation, 12, script::Withdraw{1});
        EXPECT_EQ(pieces(simulation.wire()), 0);
        EXPECT_EQ(simulation.wire().segments(), 6);
        EXPECT_NEAR(simulation.inserted(), 12, 1e-9);
        return simulation.state_hash();
    };
    for (double roll = 0; roll < 6.28; roll += 0.6) {
        simulation.reset();
        const auto hash = into_the_branch(roll);
        simulation.reset();
        EXPECT_EQ(into_the_branch(roll), hash) << roll;
    }
    EXPECT_GT(with_pieces, 0);
}

TEST(Simulation, TellsOfCrossingsThatItsRelaxerDoesNotMend) {
    Simulation simulation(bifurcation("segment"), test::cache());
    go(simulation, 1, script::Rotate{5});
    double deepest = 0;
    for (int frame = 0; frame < 14; ++frame) {
        simulation.apply(script::Advance{1});
        deepest = std::max(deepest, simulation.step().deepest_crossing);
        EXPECT_EQ(pieces(simulation.wire()), 0);
    }
    EXPECT_GT(deepest, 0.1);
}

}  // namespace exercise
