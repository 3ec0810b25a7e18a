/// A wire with friction in an exercise: what a scenario may ask for, and that it replays.

#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "physics/wire/energy.h"
#include "tests/engine/exercise/wild_exercise.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

scenario::Scenario with_friction(double friction) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.wire().device.friction = friction;
    physics::stiffen(scenario.wire().device);
    scenario.torsion = scenario::TorsionModel::Auto;
    return scenario;
}

std::vector<script::Command> wild(std::mt19937& random) {
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    std::vector<script::Command> commands;
    if (random() % 3 != 0) commands.emplace_back(script::Advance{6 * unit()});
    if (random() % 3 == 0) commands.emplace_back(script::Withdraw{6 * unit()});
    if (random() % 3 == 0) commands.emplace_back(script::Rotate{3 * (unit() - 0.5)});
    return commands;
}

TEST(FrictionScenario, KeysAreReadAndTheWallScalesTheWire) {
    const scenario::Scenario s =
        test::small_scenario(test::small_toml_with("frictionless = true", "friction = 0.1") +
                             std::string("[wall]\nfriction = 1.5\n"));
    EXPECT_EQ(s.wire().device.friction, 0.1);
    EXPECT_NEAR(Simulation(s).wire().devices[0].spec.friction, 0.15, 1e-15);
}

TEST(FrictionScenario, ThePapersRelaxersRefuseIt) {
    scenario::Scenario s = with_friction(0.1);
    s.relaxer.kind = physics::RelaxerKind::Segment;
    ASSERT_EQ(scenario::problems(s).size(), 1u);
    test::expect_said(scenario::problems(s)[0], "kind = \"global\"");
    s = with_friction(0);
    s.relaxer.kind = physics::RelaxerKind::FirstOrder;
    s.torsion = scenario::TorsionModel::Compliant;
    test::set_torsion(s.wire().device, 188);
    ASSERT_EQ(scenario::problems(s).size(), 1u);
    test::expect_said(scenario::problems(s)[0], "torsion");
    s = with_friction(0.5);
    s.wall_friction = 3;
    ASSERT_EQ(scenario::problems(s).size(), 1u);
    test::expect_said(scenario::problems(s)[0], "up to 1");
}

TEST(FrictionScenario, ItAsksForMoreForceAndHoldsTheWire) {
    double forces[2];
    for (const bool rough : {false, true}) {
        Simulation simulation(with_friction(rough ? 0.3 : 0));
        StepReport report;
        for (int k = 0; k < 20; ++k) {
            simulation.apply(script::Advance{2});
            report = simulation.step();
            EXPECT_TRUE(report.relax.at_rest());
        }
        forces[rough] = simulation.hand(script::DeviceRole::Wire).load.push;
    }
    EXPECT_GT(forces[1], 2 * std::abs(forces[0]));
}

TEST(FrictionScenario, WildHandsEndAtRestRestoreAndReplay) {
    const int rounds = 6;
    for (unsigned seed = 0; seed < rounds; ++seed) {
        scenario::Scenario scenario = with_friction(0.05 + 0.05 * seed);
        scenario.adaptive = seed % 2 == 1;
        if (seed % 3 != 0) test::set_torsion(scenario.wire().device, 60 * seed);
        scenario.torsion =
            seed % 2 == 0 ? scenario::TorsionModel::Compliant : scenario::TorsionModel::Segments;
        Exercise exercise(scenario, false);
        test::play_wildly_and_again(exercise, seed, wild);
        if (HasFatalFailure()) return;
    }
}

TEST(FrictionScenario, TwentyThousandIdleFramesMoveNothing) {
    scenario::Scenario scenario = with_friction(0.2);
    scenario.motion.heart_rate = 70;
    scenario.motion.heart_reach = {2, 1, 1};
    scenario.motion.breathing_rate = 14;
    scenario.motion.breathing_reach = {0, 2, 6};
    scenario.imaging.patient = true;
    Simulation simulation(scenario);
    for (int k = 0; k < 15; ++k) {
        simulation.apply(script::Advance{2});
        simulation.apply(script::Rotate{0.2});
        simulation.step();
    }
    const geometry::Vec3 tip = simulation.wire().tip();
    for (int k = 0; k < 20'000; ++k) simulation.step();
    EXPECT_LT((simulation.wire().tip() - tip).norm(), 1e-3);
}

TEST(FrictionScenario, AResetBeginsWithoutDrag) {
    Simulation simulation(with_friction(0.2));
    const std::uint64_t start = simulation.state_hash();
    for (int k = 0; k < 10; ++k) {
        simulation.apply(script::Advance{3});
        simulation.step();
    }
    EXPECT_NE(simulation.state_hash(), start);
    simulation.reset();
    simulation.step();
    Simulation fresh(with_friction(0.2));
    fresh.step();
    EXPECT_EQ(geometry::state_hash_of(simulation.wire()), geometry::state_hash_of(fresh.wire()));
    EXPECT_EQ(simulation.wire().friction_loss, 0);
}

}  // namespace
}  // namespace exercise
