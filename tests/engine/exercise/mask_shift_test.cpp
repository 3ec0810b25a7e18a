/// Pixel shift as a command, and DSA of a patient who moves or holds his breath.

#include <cmath>
#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "engine/exercise/room_readout.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/exercise/with_body.h"

namespace exercise {
namespace {

using Commands = std::vector<script::Command>;
using script::ImagingMode;
using Way = script::ShiftMask::Mode;

/// The tube in a patient who breathes and whose heart beats.
scenario::Scenario moving_scenario() {
    return test::small_scenario_with_patient(
        "[motion]\nheart_rate_per_min = 70\nheart_reach_mm = [0, 1, 2]\nbreathing_rate_per_min = 30\n"
        "breathing_reach_mm = [0, 2, -12]\nbreath_hold_s = 3\n");
}

const Commands start_dsa{script::Beam{true}, script::SetMode{ImagingMode::Dsa}};

const char* const moving_script =
    "0 beam on\n0 mode dsa\n1 contrast 60 mg/ml\n6 shift auto\n9 shift by 0.5 -1.5 px\n12 advance 3 mm\n"
    "14 mode roadmap\n16 shift by -2 0 px\n18 shift auto\n20 breath hold\n24 mode dsa\n24 mask\n"
    "30 beam off\n31 shift 1.25 2 px\n33 breath free\n34 beam on\n36 mode live\n39 end\n";

using MaskShiftTest = test::WithBody;

}  // namespace

TEST_F(MaskShiftTest, ActsOnTheImageThatIsShownAndEndsWithItsMask) {
    Exercise exercise(moving_scenario(), true);
    const auto next = [&](const Commands& commands) -> std::vector<MaskShift> {
        return exercise.next_frame(commands).mask_shifts;
    };
    const auto shift_now = [&] { return exercise.monitor()->mask_shift(); };
    EXPECT_EQ(next({script::Beam{true}, script::ShiftMask{Way::To, 2, 1}})[0].outcome,
              MaskShift::Outcome::NoMask);
    next(start_dsa);
    const render::GrayImage before = (next({script::Contrast{60}}), exercise.image());
    next({script::Beam{false}});
    // The last image is held, and shifted all the same.
    const std::vector<MaskShift> made = next({script::ShiftMask{Way::To, 2, -1}});
    ASSERT_EQ(made.size(), 1u);
    EXPECT_EQ(made[0].x, 2);
    EXPECT_EQ(made[0].y, -1);
    EXPECT_NE(exercise.image(), before);
    EXPECT_EQ(next({script::ShiftMask{Way::By, 0.5, 0}})[0].x, 2.5);
    const std::vector<MaskShift> far = next({script::ShiftMask{Way::By, 100, -100}});
    EXPECT_EQ(far[0].x, 16);
    EXPECT_EQ(far[0].y, -16);
    EXPECT_TRUE(far[0].limited);
    EXPECT_EQ(next({script::ShiftMask{Way::By, 1, 1}, script::ShiftMask{}}).size(), 2u);
    EXPECT_EQ(exercise.image(), before);
    next({script::ShiftMask{Way::To, 3, 0}});
    EXPECT_EQ(shift_now().x, 3);
    // Fluoroscopy has no mask; back in DSA the shift is still there, until there is a new mask.
    next({script::Beam{true}, script::SetMode{ImagingMode::Live}});
    EXPECT_EQ(shift_now().x, 0);
    EXPECT_EQ(next({script::ShiftMask{Way::Auto, 0, 0}})[0].outcome, MaskShift::Outcome::NoMask);
    next({script::SetMode{ImagingMode::Dsa}});
    EXPECT_EQ(shift_now().x, 3);
    next({script::NewMask{}});
    EXPECT_EQ(shift_now().x, 0);
}

TEST_F(MaskShiftTest, IsToldInTheRoomAndAfterARun) {
    Exercise exercise(moving_scenario(), true);
    RoomReadout readout;
    Notices notices;
    const auto next = [&](const Commands& commands) {
        const Frame frame = exercise.next_frame(commands);
        readout.observe(frame, exercise.score());
        notices.observe(frame);
        return readout.read(frame, exercise.score());
    };
    next(start_dsa);
    for (int k = 0; k < 6; ++k) next({});
    const render::Readout shown = next({script::ShiftMask{Way::To, 1.25, -2}, script::Breathe{true}});
    ASSERT_FALSE(shown.messages.empty());
    EXPECT_EQ(shown.messages.back().text, "The mask was shifted by 1.25 pixels to the right and 2.00 up");
    ASSERT_TRUE(shown.image);
    EXPECT_EQ(render::mask_shift_text(shown.image->mask_x, shown.image->mask_y), "mask 1.2 right 2.0 up px");
    EXPECT_EQ(render::mask_shift_text(0, 0), "");
    EXPECT_FALSE(shown.breath_held) << "the patient breathes out first";
    bool held = false, gasped = false;
    for (int k = 0; k < 90; ++k) {
        const render::Readout then = next({});
        held = held || (then.breath_held && *then.breath_held > 2.5);
        for (const render::Message& message : then.messages)
            gasped = gasped || message.text.starts_with("The patient gasps");
    }
    EXPECT_TRUE(held);
    EXPECT_TRUE(gasped);
    next({script::ShiftMask{Way::Auto, 0, 0}});
    const std::vector<std::string> told = notices.text();
    const auto says = [&](const std::string& words) {
        return std::any_of(told.begin(), told.end(),
                           [&](const std::string& text) { return text.find(words) != std::string::npos; });
    };
    EXPECT_TRUE(says("frame 98: The mask"));
    EXPECT_TRUE(says("the patient had to breathe once"));
}

TEST_F(MaskShiftTest, ARecordedRunIsReplayedToTheLastBit) {
    const test::TemporaryFolder folder;
    const script::CommandScript script = script::parse_commands(moving_script, "moving.gw");
    Exercise first(moving_scenario(), true);
    EXPECT_TRUE(first.simulation().problems(script).empty());
    first.record(folder / "run.gw", {{}, 1});
    std::vector<render::GrayImage> shown;
    for (int frame = 0; frame < 40; ++frame) {
        first.next_frame(test::commands_of(script, frame));
        shown.push_back(first.image());
    }
    first.close_recording();
    const script::CommandScript recorded = script::load_commands(folder / "run.gw");
    Exercise again(moving_scenario(), true);
    for (int frame = 0; frame < 40; ++frame) {
        again.next_frame(test::commands_of(recorded, frame));
        EXPECT_EQ(recorded.checks[frame].hash, again.simulation().state_hash()) << frame;
        EXPECT_EQ(again.image(), shown[frame]) << frame;
    }
    // Looked at only here and there, the images are the same.
    Exercise seldom(moving_scenario(), true);
    for (int frame = 0; frame < 40; ++frame) {
        seldom.next_frame(test::commands_of(recorded, frame));
        if (frame % 7 == 3) {
            EXPECT_EQ(seldom.image(), shown[frame]) << frame;
        }
    }
}

TEST_F(MaskShiftTest, AMovingPatientIsTakenBackAndSoughtToTheLastBit) {
    const script::CommandScript script = script::parse_commands(moving_script, "moving.gw");
    Exercise straight(moving_scenario(), true), other(moving_scenario(), true);
    std::vector<render::GrayImage> shown;
    std::vector<Exercise::Snapshot> moments;
    for (int frame = 0; frame < 40; ++frame) {
        moments.push_back(straight.snapshot());
        straight.next_frame(test::commands_of(script, frame));
        shown.push_back(straight.image());
    }
    // Forward and back, in the exercise itself and in one that never was there.
    for (const int from : {33, 8, 21, 17, 0, 31}) {
        for (Exercise* exercise : {&straight, &other}) {
            exercise->restore(moments[static_cast<std::size_t>(from)]);
            for (int frame = from; frame < std::min(from + 9, 40); ++frame) {
                exercise->next_frame(test::commands_of(script, frame));
                ASSERT_EQ(exercise->image(), shown[frame]) << "from " << from << ", frame " << frame;
            }
        }
    }
    EXPECT_EQ(straight.snapshot().state, other.snapshot().state);
}

TEST_F(MaskShiftTest, InAHeldBreathNothingMovesButTheHeart) {
    const auto background = [](bool hold) {
        scenario::Scenario scenario = moving_scenario();
        scenario.motion.heart_reach.setZero();
        Exercise exercise(scenario, true);
        exercise.next_frame({});
        exercise.next_frame(Commands{script::Breathe{hold}});
        for (int k = 0; k < 30; ++k) exercise.next_frame({});
        exercise.next_frame(start_dsa);
        const double at_mask = exercise.monitor()->last_pulse()->exposure.breath;
        double farthest = 0;
        for (int k = 0; k < 12; ++k) {
            exercise.next_frame({});
            farthest =
                std::max(farthest, std::abs(exercise.monitor()->last_pulse()->exposure.breath - at_mask));
        }
        return farthest;
    };
    EXPECT_EQ(background(true), 0);
    EXPECT_GT(background(false), 0.5);
}

}  // namespace exercise
