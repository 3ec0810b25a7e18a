/// Vessels that stay where they are as long as no device pushes them aside, which is decided anew as it goes.

#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/room_readout.h"
#include "tests/anatomies.h"
#include "tests/engine/exercise/wild_exercise.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

scenario::Scenario scene(const std::string& name) {
    scenario::Scenario s = test::shipped_scenario(name);
    s.budget.updates *= 20;
    return s;
}

/// Down the aorta and into a leg, whose vessels no part of this wire pushes aside so that it shows; past the
/// mouth of the IMA at first, into which it could go.
void go_down(Simulation& simulation, int frames = 60) {
    for (int k = 0; k < frames; ++k) {
        simulation.apply(script::Advance{2});
        simulation.step();
    }
}

TEST(VesselChoice, VesselsStayOnTheWayDownTheAortaAndAreLessWork) {
    scenario::Scenario moving = scene("stenosis"), open = moving;
    moving.tissue.rigid = false;
    Simulation stay(open, test::cache()), move(moving, test::cache());
    EXPECT_TRUE(stay.vessels_stay());
    EXPECT_FALSE(move.vessels_stay());
    test::expect_said(stay.vessels_sentence(), "vessels stay where they are");
    test::expect_said(move.vessels_sentence(), "make way as asked");
    long long queries_stay = 0, queries_move = 0;
    for (int k = 0; k < 50; ++k)
        for (Simulation* s : {&stay, &move}) {
            s->apply(script::Advance{2});
            (s == &stay ? queries_stay : queries_move) += s->step().relax.wall_queries;
            ASSERT_LE(s->farthest_vessel_move(), stay.vessel_give().most) << "frame " << k;
        }
    EXPECT_TRUE(stay.vessels_stay());
    EXPECT_EQ(stay.farthest_vessel_move(), 0);
    EXPECT_GT(move.farthest_vessel_move(), 0);
    EXPECT_LT((stay.tip() - move.tip()).norm(), scenario::vessel_give_shows);
    EXPECT_LT(queries_stay, queries_move);
}

TEST(VesselChoice, VesselsMakeWayWhereADeviceComesToASoftBendAndStayAgainBehindIt) {
    Simulation simulation(scene("iliac_aorta"), test::cache());
    ASSERT_TRUE(simulation.vessels_stay());
    int changes = 0;
    bool before = true;
    for (int frame = 0; frame < 220; ++frame) {
        simulation.apply(frame < 110 ? script::Command(script::Advance{2})
                                     : script::Command(script::Withdraw{2}));
        const StepReport report = simulation.step();
        const bool stay = simulation.vessels_stay();
        changes += !report.vessels.empty();
        if (!report.vessels.empty() && !report.settling) {
            EXPECT_NE(stay, before) << "frame " << frame;
        }
        before = stay;
        if (frame == 109) {
            EXPECT_FALSE(stay);
        }
    }
    EXPECT_TRUE(simulation.vessels_stay());
    EXPECT_GE(changes, 2);
    EXPECT_EQ(simulation.model_changes().vessels, changes);
    EXPECT_EQ(simulation.farthest_vessel_move(), 0);
}

TEST(VesselChoice, AScenarioThatSaysSoKeepsIt) {
    for (const bool rigid : {false, true}) {
        scenario::Scenario s = scene("iliac_aorta");
        s.tissue.rigid = rigid;
        Simulation simulation(s, test::cache());
        go_down(simulation);
        EXPECT_EQ(simulation.vessels_stay(), rigid);
        EXPECT_EQ(simulation.model_changes().vessels, 0);
    }
}

/// What presses on nothing has nothing to give back.
TEST(VesselChoice, AChangeHardlyMovesTheTip) {
    Simulation simulation(scene("iliac_aorta"), test::cache());
    bool changed = false;
    for (int frame = 0; frame < 80 && !changed; ++frame) {
        simulation.apply(script::Advance{2});
        const geometry::Vec3 before = simulation.tip();
        changed = !simulation.step().vessels.empty();
        if (changed) {
            EXPECT_LT((simulation.tip() - before).norm(), 2.2) << "a frame's feed and hardly more";
        }
    }
    EXPECT_TRUE(changed);
}

TEST(VesselChoice, ACopyMadeBeforeAChangeGoesOnToTheLastBitAndAResetBeginsAsAtFirst) {
    Simulation simulation(scene("iliac_aorta"), test::cache());
    const std::uint64_t start = simulation.state_hash();
    Simulation copy(simulation);
    for (int frame = 0; frame < 130; ++frame) {
        for (Simulation* s : {&simulation, &copy}) {
            s->apply(frame < 70 ? script::Command(script::Advance{2}) : script::Command(script::Withdraw{2}));
            s->step();
        }
        ASSERT_EQ(simulation.state_hash(), copy.state_hash()) << "frame " << frame;
        if (frame % 10 == 0) {
            Simulation other(simulation);
            ASSERT_EQ(other.state_hash(), simulation.state_hash());
        }
    }
    EXPECT_GE(simulation.model_changes().vessels, 1);
    simulation.reset();
    EXPECT_EQ(simulation.state_hash(), start);
    EXPECT_TRUE(simulation.vessels_stay());
}

TEST(VesselChoice, WildHandsEndAtRestRestoreAndReplayOverChanges) {
    int changes = 0;
    for (unsigned seed = 0; seed < 3; ++seed) {
        Exercise exercise(scene(seed == 1 ? "renal" : "iliac_aorta"), false, test::cache());
        test::play_wildly_and_again(exercise, seed, [](std::mt19937& random) {
            const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
            std::vector<script::Command> commands;
            if (random() % 3 != 0) commands.emplace_back(script::Advance{10 * unit()});
            if (random() % 4 == 0) commands.emplace_back(script::Withdraw{12 * unit()});
            if (random() % 3 == 0) commands.emplace_back(script::Rotate{3 * (unit() - 0.5)});
            return commands;
        });
        if (HasFatalFailure()) return;
        changes += exercise.simulation().model_changes().vessels;
    }
    EXPECT_GE(changes, 2);
}

TEST(VesselChoice, ARunTellsEveryChange) {
    Exercise exercise(scene("iliac_aorta"), false, test::cache());
    Notices notices;
    for (int frame = 0; frame < 70; ++frame) notices.observe(exercise.next_frame({{script::Advance{2}}}));
    int told = 0;
    for (const std::string& text : notices.text()) told += text.find("from now on vessels") != text.npos;
    EXPECT_EQ(told, exercise.simulation().model_changes().vessels);
    EXPECT_GE(told, 1);
}

}  // namespace
}  // namespace exercise
