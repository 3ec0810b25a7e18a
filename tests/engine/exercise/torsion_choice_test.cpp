/// Shafts whose model is decided anew as the device goes.

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/room_readout.h"
#include "tests/engine/exercise/wild_exercise.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using physics::Torsion;

/// A tube that runs straight for 150 mm before it bends, and a wire with friction.
scenario::Scenario straight_then_bent(double friction = 0.2) {
    std::string text = test::small_toml;
    text = test::replaced(text, "path = [{run_mm = 30.0}, {arc_radius_mm = 25.0, angle_deg = 40.0}",
                          "path = [{run_mm = 150.0}, {arc_radius_mm = 15.0, angle_deg = 150.0}");
    text = test::replaced(text, "frictionless = true", "friction = " + std::to_string(friction));
    text = test::replaced(text, "torsion = \"rigid\"", "torsion = \"auto\"");
    return test::small_scenario(text);
}

void advance(Simulation& simulation, int frames, double mm) {
    for (int k = 0; k < frames; ++k) {
        simulation.apply(mm > 0 ? script::Command(script::Advance{mm})
                                : script::Command(script::Withdraw{-mm}));
        simulation.step();
    }
}

double hub_turn(const Simulation& simulation) {
    const physics::Device& device = simulation.wire().devices[0];
    return device.angle_at(simulation.wire().segments()) + device.wound_up();
}

TEST(TorsionChoice, AWireIsRigidUntilABendIsWithinReachAndTwistsBySegmentsWhereFrictionHoldsIt) {
    Simulation simulation(straight_then_bent());
    EXPECT_EQ(simulation.torsion(0), Torsion::Rigid);
    advance(simulation, 30, 2);  // 80 mm inside; the bend begins at 150 mm
    EXPECT_EQ(simulation.torsion(0), Torsion::Rigid);
    EXPECT_EQ(simulation.model_changes().count, 0);
    advance(simulation, 20, 2);
    EXPECT_NE(simulation.torsion(0), Torsion::Rigid);
    advance(simulation, 30, 2);
    EXPECT_EQ(simulation.torsion(0), Torsion::Segments);
    EXPECT_GT(simulation.torsion_need(0).held_back, scenario::torsion_shows / 2);
    advance(simulation, 80, -2);
    EXPECT_EQ(simulation.torsion(0), Torsion::Rigid) << "and again when it is out of reach";
    EXPECT_LE(simulation.model_changes().count, 6) << "not back and forth";
}

TEST(TorsionChoice, AScenarioThatFixesAModelKeepsIt) {
    for (const auto& [asked, is] : {std::pair{scenario::TorsionModel::Rigid, Torsion::Rigid},
                                    {scenario::TorsionModel::Compliant, Torsion::Whole},
                                    {scenario::TorsionModel::Segments, Torsion::Segments}}) {
        scenario::Scenario s = straight_then_bent();
        s.torsion = asked;
        Simulation simulation(s);
        EXPECT_EQ(simulation.torsion(0), is);
        advance(simulation, 60, 3);
        EXPECT_EQ(simulation.torsion(0), is);
        EXPECT_EQ(simulation.model_changes().count, 0);
    }
}

/// The hub's turn is what the hand turned it by, over every change of the model, and the tip goes on by a
/// degree at most when a shaft becomes rigid.
TEST(TorsionChoice, AChangeLosesNoAngleAndHardlyMovesTheTip) {
    Simulation simulation(straight_then_bent());
    double turned = hub_turn(simulation);
    Torsion before = simulation.torsion(0);
    int changes = 0;
    for (int frame = 0; frame < 240; ++frame) {
        const bool in = frame < 90 || frame >= 190;
        simulation.apply(in ? script::Command(script::Advance{1.6}) : script::Command(script::Withdraw{1.6}));
        if (frame % 2 == 0) simulation.apply(script::Rotate{0.05}), turned += 0.05;
        const StepReport report = simulation.step();
        ASSERT_EQ(report.waiting_rotation, 0) << "frame " << frame;
        ASSERT_NEAR(std::remainder(hub_turn(simulation) - turned, 2 * std::numbers::pi), 0, 1e-9)
            << "frame " << frame;
        changes += simulation.torsion(0) != before;
        EXPECT_EQ(report.torsions.empty(), simulation.torsion(0) == before);
        before = simulation.torsion(0);
    }
    EXPECT_GE(changes, 3);
    EXPECT_EQ(simulation.model_changes().count, changes);
    EXPECT_TRUE(std::isfinite(simulation.model_changes().released));
}

TEST(TorsionChoice, AResetBeginsAsAtFirst) {
    Simulation simulation(straight_then_bent());
    const std::uint64_t start = simulation.state_hash();
    advance(simulation, 80, 2);
    EXPECT_GT(simulation.model_changes().count, 0);
    simulation.reset();
    EXPECT_EQ(simulation.state_hash(), start);
}

TEST(TorsionChoice, ACopyMadeBeforeAChangeGoesOnToTheLastBit) {
    Simulation simulation(straight_then_bent());
    advance(simulation, 40, 2);
    ASSERT_EQ(simulation.model_changes().count, 0);
    Simulation copy(simulation);
    for (int frame = 0; frame < 100; ++frame) {
        for (Simulation* s : {&simulation, &copy}) {
            s->apply(frame < 50 ? script::Command(script::Advance{1.5})
                                : script::Command(script::Withdraw{2}));
            s->apply(script::Rotate{0.1});
            s->step();
        }
        ASSERT_EQ(simulation.state_hash(), copy.state_hash()) << "frame " << frame;
        if (frame % 10 == 0) {
            Simulation other(simulation);
            ASSERT_EQ(other.state_hash(), simulation.state_hash());
        }
    }
    EXPECT_GE(simulation.model_changes().count, 2);
}

TEST(TorsionChoice, WildHandsEndAtRestRestoreAndReplayOverChanges) {
    int changes = 0;
    for (unsigned seed = 0; seed < 6; ++seed) {
        scenario::Scenario s = straight_then_bent(0.05 + 0.05 * seed);
        s.wire().inserted = 70;
        s.adaptive = seed % 2 == 1;
        Exercise exercise(s, false);
        test::play_wildly_and_again(exercise, seed, [](std::mt19937& random) {
            const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
            std::vector<script::Command> commands;
            if (random() % 3 != 0) commands.emplace_back(script::Advance{8 * unit()});
            if (random() % 3 == 0) commands.emplace_back(script::Withdraw{10 * unit()});
            if (random() % 3 == 0) commands.emplace_back(script::Rotate{3 * (unit() - 0.5)});
            return commands;
        });
        if (HasFatalFailure()) return;
        changes += exercise.simulation().model_changes().count;
    }
    EXPECT_GE(changes, 6);
}

TEST(TorsionChoice, ARunTellsEveryChange) {
    Exercise exercise(straight_then_bent(), false);
    Notices notices;
    for (int frame = 0; frame < 60; ++frame) notices.observe(exercise.next_frame({{script::Advance{2}}}));
    int told = 0;
    for (const std::string& text : notices.text())
        told += text.find("from now on the wire's shaft") != text.npos;
    EXPECT_EQ(told, exercise.simulation().model_changes().count);
    EXPECT_GE(told, 1);
}

}  // namespace
}  // namespace exercise
