/// Snapshots: whatever an exercise was doing, once restored and stepped on it does the same to the bit.

#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/score.h"
#include "engine/exercise/score_file.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using Commands = std::vector<script::Command>;

void expect_same(Exercise& a, Exercise& b, unsigned seed, int frame) {
    EXPECT_EQ(a.simulation().state_hash(), b.simulation().state_hash()) << "seed " << seed << ", " << frame;
    EXPECT_EQ(a.image(), b.image()) << "seed " << seed << ", " << frame;
    const auto report = [](const Exercise& exercise) {
        return to_json({"", "", exercise.finish(), exercise.earlier_attempts(), {}});
    };
    EXPECT_EQ(report(a), report(b)) << "seed " << seed << ", " << frame;
    EXPECT_EQ(a.snapshot().state, b.snapshot().state) << "seed " << seed << ", " << frame;
}

}  // namespace

TEST(Snapshot, RestoredItGoesOnAsItWentOn) {
    // One is played through, the other is put back to where it was, again and again.
    // With a budget that most motions wait for, so that the wire is on its way at most snapshots; and with
    // the paper's relaxer.
    const scenario::Scenario scenarios[] = {
        test::small_scenario(),
        test::small_scenario_with("updates_per_frame = 20000", "updates_per_frame = 60"),
        test::small_scenario_with("updates_per_frame = 20000",
                                  "updates_per_frame = 400\nkind = \"segment\"")};
    int working = 0;
    for (const scenario::Scenario& scenario : scenarios) {
        Exercise straight(scenario, true), other(scenario, true);
        for (unsigned seed = 1; seed <= 10; ++seed) {
            std::mt19937 random(seed);
            straight.next_frame(Commands{script::Reset{}, script::Beam{true}});
            bool settling = false;
            for (int frame = 0; frame < 12; ++frame)
                settling = straight.next_frame(test::random_commands(random)).motion.settling;
            const Exercise::Snapshot snapshot = straight.snapshot();
            other.restore(snapshot);
            working += settling;
            expect_same(straight, other, seed, 0);
            for (int frame = 1; frame <= 8; ++frame) {
                const Commands commands = test::random_commands(random);
                straight.next_frame(commands);
                other.next_frame(commands);
                expect_same(straight, other, seed, frame);
                if (testing::Test::HasFailure()) return;
            }
        }
    }
    EXPECT_GT(working, 5);
}

TEST(Snapshot, TakesAnExerciseBack) {
    Exercise exercise(test::small_scenario(), true);
    exercise.next_frame(Commands{script::Beam{true}, script::SetMode{script::ImagingMode::Dsa},
                                 script::Inject{3, 6, "tube", 320}, script::SetPulseRate{7.5}});
    exercise.next_frame(Commands{script::Advance{6}});
    const Exercise::Snapshot snapshot = exercise.snapshot();
    std::vector<render::GrayImage> first;
    std::vector<std::uint64_t> states;
    for (int round = 0; round < 2; ++round) {
        for (int frame = 0; frame < 8; ++frame) {
            const Frame made = exercise.next_frame(Commands{script::Advance{1.5}, script::Rotate{0.4}});
            EXPECT_EQ(made.time.index, 2 + frame);
            if (round == 0) {
                first.push_back(exercise.image());
                states.push_back(exercise.simulation().state_hash());
            } else {
                EXPECT_EQ(exercise.image(), first[frame]) << frame;
                EXPECT_EQ(exercise.simulation().state_hash(), states[frame]) << frame;
            }
        }
        exercise.restore(snapshot);
    }
}

TEST(Snapshot, OfAnotherExerciseIsRefusedAndChangesNothing) {
    Exercise lit(test::small_scenario(), true), dark(test::small_scenario(), false);
    lit.next_frame(Commands{script::Advance{3}});
    const std::uint64_t before = dark.simulation().state_hash();
    EXPECT_THROW(dark.restore(lit.snapshot()), io::InputError);
    EXPECT_EQ(dark.simulation().state_hash(), before);
    dark.restore(dark.snapshot());
    // Another wire in the same vessel, of the same name.
    Exercise stiffer(test::small_scenario_with("device = \"glide035\"", "device = \"bentson035\""), false);
    EXPECT_THROW(stiffer.restore(dark.snapshot()), io::InputError);
}

TEST(Snapshot, StatesThatPartLaterDiffer) {
    // Pedals pressed a frame apart, at half as many pulses as frames: all that is seen is equal, but one has
    // its pulses in even frames and one in odd.
    Exercise even(test::small_scenario(), false), odd(test::small_scenario(), false);
    const script::SetPulseRate slow{7.5};
    even.next_frame(Commands{slow, script::Beam{true}});
    odd.next_frame(Commands{slow});
    even.next_frame({});
    odd.next_frame(Commands{script::Beam{true}});
    for (int frame = 0; frame < 6; ++frame) {
        EXPECT_NE(even.simulation().state_hash(), odd.simulation().state_hash()) << frame;
        EXPECT_NE(even.next_frame({}).motion.console.pulse, odd.next_frame({}).motion.console.pulse);
    }
    // A mask that was asked for waits for a pulse; an injection runs; a motion waits.
    for (const script::Command& command :
         {script::Command(script::NewMask{}), script::Command(script::Inject{5, 1, "tube", 320}),
          script::Command(script::StoreReference{}), script::Command(script::Advance{1e-6}),
          script::Command(script::ShiftMask{}), script::Command(script::Breathe{true})}) {
        Simulation asked(test::small_scenario()), not_asked(test::small_scenario());
        asked.apply(command);
        EXPECT_NE(asked.state_hash(), not_asked.state_hash()) << script::to_text(command);
    }
}

}  // namespace exercise
