#include "engine/exercise.h"

#include <algorithm>

#include "tests/engine/fixtures.h"

namespace engine {
namespace {

using Commands = std::vector<Command>;

/// Frames with the commands given; returns the images of all.
std::vector<render::GrayImage> images(const std::vector<Commands>& frames) {
    Exercise exercise(test::small_scenario(), true);
    std::vector<render::GrayImage> shown;
    for (const Commands& commands : frames) {
        exercise.next_frame(commands);
        shown.push_back(exercise.image());
    }
    return shown;
}

}  // namespace

TEST(Exercise, ScreenIsBlackBeforeTheFirstPulseAndHoldsTheLast) {
    const auto shown = images({{}, {Beam{true}}, {Beam{false}, Advance{4}}, {}});
    EXPECT_EQ(*std::max_element(shown[0].pixels.begin(), shown[0].pixels.end()), 0);
    EXPECT_NE(shown[1], shown[0]);
    EXPECT_EQ(shown[2], shown[1]);
    EXPECT_EQ(shown[3], shown[1]);
}

TEST(Exercise, ImagesDoNotDependOnWhichWereLookedAt) {
    const std::vector<Commands> frames = {{Beam{true}}, {Advance{2}}, {Beam{false}}, {Advance{2}}, {}};
    const auto all = images(frames);
    Exercise exercise(test::small_scenario(), true);
    for (const Commands& commands : frames) exercise.next_frame(commands);
    EXPECT_EQ(exercise.image(), all.back());
}

TEST(Exercise, BeamAndImagesLeaveTheWireAlone) {
    Exercise lit(test::small_scenario(), true), dark(test::small_scenario(), false);
    for (int frame = 0; frame < 5; ++frame) {
        lit.next_frame(frame == 0 ? Commands{Beam{true}, Advance{2}} : Commands{Advance{2}});
        lit.image();
        dark.next_frame(Commands{Advance{2}});
    }
    EXPECT_EQ(lit.simulation().wire().joints, dark.simulation().wire().joints);
}

TEST(Exercise, ImagesAfterAResetAreThoseOfAFreshLoad) {
    const auto used = images({{Beam{true}, Advance{4}}, {Advance{4}}, {Reset{}, Beam{true}}, {Advance{2}}});
    const auto fresh = images({{Beam{true}}, {Advance{2}}});
    EXPECT_EQ(used[2], fresh[0]);
    EXPECT_EQ(used[3], fresh[1]);
}

TEST(Exercise, ContrastDarkensTheVessel) {
    // 25 to 45 mm along, ahead of the wire: columns 27 to 33 of the two middle rows.
    const auto vessel = [](const render::GrayImage& image) {
        double sum = 0;
        for (int row = 31; row <= 32; ++row) {
            for (int column = 27; column <= 33; ++column) sum += image.pixels[row * image.width + column];
        }
        return sum / 14;
    };
    const auto shown = images({{Beam{true}}, {Contrast{60}}});
    EXPECT_LT(vessel(shown[1]), vessel(shown[0]) - 5);
}

TEST(Exercise, AnglesOfTheWindowAreReplayedExactly) {
    const test::TemporaryFolder folder;
    Exercise first(test::small_scenario(), false);
    first.record(folder / "run.gw", {"test", "small", 1});
    for (int i = 1; i < 6; ++i) first.next_frame(Commands{Rotate{std::sqrt(i) / 7}, Advance{1.0 / 3}});
    first.close_recording();
    Exercise second(test::small_scenario(), false);
    const CommandScript script = load_commands(folder / "run.gw");
    for (int frame = 0; frame < 5; ++frame) {
        Commands commands;
        for (const TimedCommand& c : script.commands) {
            if (c.frame == frame) commands.push_back(c.command);
        }
        second.next_frame(commands);
        EXPECT_EQ(script.checks[frame].hash, second.simulation().state_hash()) << frame;
    }
}

TEST(Exercise, TimeIsUpAfterTheLimit) {
    Scenario scenario = test::small_scenario();
    scenario.time_limit = 0.2;  // three frames of 1/15 s
    Exercise exercise(scenario, false);
    exercise.next_frame({});
    exercise.next_frame({});
    EXPECT_FALSE(exercise.time_is_up());
    exercise.next_frame({});
    EXPECT_TRUE(exercise.time_is_up());
}

}  // namespace engine
