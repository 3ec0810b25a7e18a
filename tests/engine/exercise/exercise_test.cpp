#include "engine/exercise/exercise.h"

#include <algorithm>

#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using Commands = std::vector<script::Command>;

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

/// Mean grey of the vessel ahead of the wire: columns 27 to 33 of the two middle rows.
double vessel_grey(const render::GrayImage& image) {
    double sum = 0;
    for (int row = 31; row <= 32; ++row) {
        for (int column = 27; column <= 33; ++column) sum += image.pixels[row * image.width + column];
    }
    return sum / 14;
}

}  // namespace

TEST(Exercise, ScreenIsBlackBeforeTheFirstPulseAndHoldsTheLast) {
    const auto shown = images({{}, {script::Beam{true}}, {script::Beam{false}, script::Advance{4}}, {}});
    EXPECT_EQ(*std::max_element(shown[0].pixels.begin(), shown[0].pixels.end()), 0);
    EXPECT_NE(shown[1], shown[0]);
    EXPECT_EQ(shown[2], shown[1]);
    EXPECT_EQ(shown[3], shown[1]);
}

TEST(Exercise, ImagesAfterAResetAreThoseOfAFreshLoad) {
    const auto used = images({{script::Beam{true}, script::Advance{4}},
                              {script::Advance{4}},
                              {script::Reset{}, script::Beam{true}},
                              {script::Advance{2}}});
    const auto fresh = images({{script::Beam{true}}, {script::Advance{2}}});
    EXPECT_EQ(used[2], fresh[0]);
    EXPECT_EQ(used[3], fresh[1]);
}

TEST(Exercise, ContrastDarkensTheVessel) {
    const auto shown = images({{script::Beam{true}}, {script::Contrast{60}}});
    EXPECT_LT(vessel_grey(shown[1]), vessel_grey(shown[0]) - 5);
}

TEST(Exercise, DsaShowsContrastAloneAndRoadmapKeepsIt) {
    const auto shown = images({{script::Beam{true}, script::SetMode{script::ImagingMode::Dsa}},
                               {script::Contrast{60}},
                               {script::Contrast{0}},
                               {script::SetMode{script::ImagingMode::Roadmap}},
                               {}});
    EXPECT_LT(vessel_grey(shown[1]), vessel_grey(shown[0]) - 20);
    EXPECT_NEAR(vessel_grey(shown[2]), vessel_grey(shown[0]), 10) << "the contrast has left";
    double background = 0;
    for (int column = 20; column < 40; ++column) background += shown[3].pixels[20 * 64 + column] / 20.0;
    EXPECT_GT(vessel_grey(shown[3]), background + 10) << "the map is bright";
}

TEST(Exercise, ARoadmapIsLostWhenTheArmTheTableOrTheFieldMoves) {
    const std::vector<script::Command> moves = {
        script::MoveArm{0.1, {}, {}, {}, {}, {}}, script::MoveTable{{0, 0, 5}},
        script::MoveArm{{}, {}, {}, {}, 80.0, {}}, script::Collimate{40, 40}};
    for (const script::Command& move : moves) {
        Exercise exercise(test::small_scenario(), true);
        const auto next = [&](const Commands& commands) { exercise.next_frame(commands); };
        next({script::Beam{true}, script::SetMode{script::ImagingMode::Dsa}});
        next({script::Contrast{60}});
        next({script::SetMode{script::ImagingMode::Roadmap}});
        EXPECT_FALSE(exercise.monitor()->map_is_missing());
        next({move});
        EXPECT_TRUE(exercise.monitor()->map_is_missing()) << script::to_text(move);
    }
}

TEST(Exercise, AMaskAskedForIsTakenByTheNextPulseOfDsa) {
    Exercise exercise(test::small_scenario(), true);
    const auto next = [&](const Commands& commands) { exercise.next_frame(commands); };
    next({script::Beam{true}, script::SetMode{script::ImagingMode::Dsa}});
    next({script::Contrast{60}});
    next({script::SetMode{script::ImagingMode::Roadmap}, script::NewMask{}});
    EXPECT_FALSE(exercise.monitor()->map_is_missing());
    next({script::SetMode{script::ImagingMode::Dsa}});
    next({script::SetMode{script::ImagingMode::Roadmap}});
    EXPECT_TRUE(exercise.monitor()->map_is_missing());
}

TEST(Exercise, LiveImagesKeepAShareOfThoseBefore) {
    // A wire that moved on leaves a shadow for a pulse or two.
    const auto shown =
        images({{script::Beam{true}}, {script::Advance{20}}, {script::Withdraw{20}}, {}, {}, {}, {}});
    const auto still = images({{script::Beam{true}}, {}, {}, {}, {}, {}, {}});
    EXPECT_GT(render::difference(shown[2], still[2]).largest, render::difference(shown[6], still[6]).largest);
    EXPECT_EQ(shown[6], still[6]);
}

TEST(Exercise, FewerPulsesHoldTheImageAndSpareDose) {
    Exercise every(test::small_scenario(), true), third(test::small_scenario(), true);
    every.next_frame(Commands{script::Beam{true}});
    third.next_frame(Commands{script::Beam{true}, script::SetPulseRate{7.5}});
    const render::GrayImage first = third.image();
    for (int frame = 1; frame < 8; ++frame) {
        every.next_frame(Commands{script::Advance{1}});
        third.next_frame(Commands{script::Advance{1}});
        if (frame == 1) {
            EXPECT_EQ(third.image(), first);
        }
        if (frame == 2) {
            EXPECT_NE(third.image(), first);
        }
    }
    EXPECT_EQ(every.monitor()->dose().pulses, 8);
    EXPECT_EQ(third.monitor()->dose().pulses, 4);
    EXPECT_NEAR(*third.score().air_kerma, 0.5 * *every.score().air_kerma, 1e-12);
    EXPECT_EQ(third.score().beam_on_time, every.score().beam_on_time);
}

TEST(Exercise, CollimationSparesAreaNotKerma) {
    const auto dose = [](const Commands& commands) {
        Exercise exercise(test::small_scenario(), true);
        exercise.next_frame(commands);
        return exercise.monitor()->dose();
    };
    const Dose open = dose({script::Beam{true}}),
               shut = dose({script::Beam{true}, script::Collimate{30, 60}});
    const double width = test::small_scenario().c_arm.detector_width;
    EXPECT_NEAR(shut.area_product / shut.air_kerma,
                open.area_product / open.air_kerma * 30 * 60 / (width * width), 1e-9);
}

TEST(Exercise, MagnificationRaisesTheDose) {
    const auto kerma = [](double width) {
        Exercise exercise(test::small_scenario(), true);
        exercise.next_frame(Commands{script::Beam{true}, script::MoveArm{{}, {}, {}, {}, width, {}}});
        return *exercise.score().air_kerma;
    };
    EXPECT_GT(kerma(150), 1.6 * kerma(300));
    EXPECT_NEAR(kerma(400), kerma(300), 0.2 * kerma(300)) << "a wider field than at the start gets no less";
}

TEST(Exercise, TheReferenceScreenKeepsItsImage) {
    Exercise exercise(test::small_scenario(), true);
    exercise.next_frame(Commands{script::Beam{true}, script::StoreReference{}});
    ASSERT_NE(exercise.monitor()->reference(), nullptr);
    const render::GrayImage stored = *exercise.monitor()->reference();
    EXPECT_EQ(stored, exercise.image());
    exercise.next_frame(Commands{script::Advance{5}});
    EXPECT_EQ(*exercise.monitor()->reference(), stored);
    exercise.next_frame(Commands{script::Reset{}});
    EXPECT_EQ(exercise.monitor()->reference(), nullptr);
}

TEST(Exercise, AnInjectionComesGoesAndIsCounted) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.entry.flush_catheter = "tube";  // so that the mask has it
    Exercise exercise(scenario, true);
    const auto next = [&](const Commands& commands) {
        exercise.next_frame(commands);
        return vessel_grey(exercise.image());
    };
    const double before = next({script::Beam{true}, script::SetMode{script::ImagingMode::Dsa}});
    double darkest = next({script::Inject{6, 6, "tube", 320}});
    for (int frame = 0; frame < 20; ++frame) darkest = std::min(darkest, next({}));
    EXPECT_LT(darkest, before - 30);
    EXPECT_NEAR(exercise.score().contrast, 6, 1e-9);
    double after = 0;
    for (int frame = 0; frame < 60; ++frame) after = next({});
    EXPECT_NEAR(after, before, 6) << "the blood has washed it out";
}

TEST(Exercise, VesselsThatMoveTakeWireAndContrastWithThem) {
    const std::string motion = "[motion]\nbreathing_rate_per_min = 60\nbreathing_reach_mm = [0, 0, 40]\n";
    Exercise still(test::small_scenario(test::small_toml_with("patient = false", "patient = true")), true);
    Exercise moving(test::small_scenario(test::small_toml_with("patient = false", "patient = true") + motion),
                    true);
    const auto row_of_the_vessel = [](Exercise& exercise) {
        exercise.next_frame(Commands{script::Beam{true}, script::SetMode{script::ImagingMode::Dsa}});
        for (int frame = 1; frame < 7; ++frame) exercise.next_frame(Commands{script::Contrast{200}});
        const render::GrayImage& image = exercise.image();
        int darkest = 0;
        for (int row = 5; row < 59; ++row) {
            if (image.pixels[row * 64 + 30] < image.pixels[darkest * 64 + 30] || darkest == 0) darkest = row;
        }
        return darkest;
    };
    const int resting = row_of_the_vessel(still), inspired = row_of_the_vessel(moving);
    EXPECT_NEAR(resting - inspired, moving.simulation().vessel_shift().z() / (300.0 / 64) * 1100 / 750, 1.5);
    EXPECT_EQ(still.simulation().wire().joints, moving.simulation().wire().joints);
}

TEST(Exercise, TimeIsUpAfterTheLimit) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.time_limit = 0.2;  // three frames of 1/15 s
    Exercise exercise(scenario, false);
    exercise.next_frame({});
    exercise.next_frame({});
    EXPECT_FALSE(exercise.time_is_up());
    exercise.next_frame({});
    EXPECT_TRUE(exercise.time_is_up());
}

}  // namespace exercise
