/// Images while C-arm and table move.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "engine/exercise/imaging.h"
#include "tests/anatomies.h"
#include "tests/engine/exercise/with_body.h"
#include "tests/engine/fixtures.h"

namespace exercise {

TEST(StandMotion, AMovingBodyIsTheSameWithFewerRaysAndTheDevicesAreAsSharp) {
    const scenario::Scenario scenario = test::shipped_scenario("coronary_lad");
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario, test::cache());
    const blood::ContrastFlow contrast(anatomy, scenario.blood);
    ImagingChain chain = make_imaging(scenario, anatomy, contrast, test::cache());
    const render::CArm& arm = scenario.c_arm;
    ASSERT_EQ(arm.pixels, 512);
    render::Exposure exposure;
    exposure.breath = 0.7;
    exposure.beat = 0.8;
    render::Exposure moves = exposure;
    moves.stand_moves = true;
    geometry::Polyline wire;
    for (int i = -40; i <= 40; ++i) wire.push_back(arm.isocentre + i * geometry::Vec3::UnitX());
    const render::Field sharp = chain.fluoroscope.expected_quanta(arm, {}, exposure),
                        coarse = chain.fluoroscope.expected_quanta(arm, {}, moves),
                        with_wire = chain.fluoroscope.expected_quanta(arm, wire, moves),
                        sharp_with_wire = chain.fluoroscope.expected_quanta(arm, wire, exposure);
    const render::Field open = chain.fluoroscope.opening(arm);
    double square = 0, mean = 0, count = 0, wire_square = 0, wire_count = 0;
    for (std::size_t i = 0; i < sharp.values.size(); ++i) {
        if (open.values[i] < 1) continue;
        const double off = std::log(coarse.values[i] / sharp.values[i]);
        square += off * off;
        mean += off;
        ++count;
        const double shadow = std::log(with_wire.values[i] / coarse.values[i]),
                     sharp_shadow = std::log(sharp_with_wire.values[i] / sharp.values[i]);
        if (sharp_shadow > -0.02) continue;
        wire_square += std::pow(shadow / sharp_shadow - 1, 2);
        ++wire_count;
    }
    // Texture is not drawn while the stand moves: 3 to 4 % of the signal in a chest.
    EXPECT_NEAR(mean / count, 0, 0.05);
    EXPECT_LT(std::sqrt(square / count), 0.06);
    ASSERT_GT(wire_count, 300);
    EXPECT_LT(std::sqrt(wire_square / wire_count), 0.05);
    EXPECT_EQ(chain.fluoroscope.technique(arm, moves).air_kerma,
              chain.fluoroscope.technique(arm, exposure).air_kerma);
    // Owes nothing to what was drawn before.
    EXPECT_EQ(chain.fluoroscope.expected_quanta(arm, {}, moves).values, coarse.values);
    EXPECT_EQ(chain.fluoroscope.expected_quanta(arm, {}, exposure).values, sharp.values);
}

using StandMotionWithBody = test::WithBody;

TEST_F(StandMotionWithBody, ImagesAreCoarseWhileTheStandMovesAndSharpThreeTenthsOfASecondLater) {
    const scenario::Scenario scenario = test::small_scenario_with_patient();
    Exercise exercise(scenario, true);
    const double frame_time = 1 / scenario.frame_rate;
    const auto frame = [&](const std::string& commands) {
        const script::CommandScript script = script::parse_commands(commands, "x.gw");
        std::vector<script::Command> now;
        for (const script::TimedCommand& timed : script.at(0)) now.push_back(timed.command);
        exercise.next_frame(now);
        const Pulse* pulse = exercise.monitor()->last_pulse();
        return pulse && pulse->exposure.stand_moves;
    };
    EXPECT_FALSE(frame("0 beam on\n0 arm lao 10 deg\n")) << "the first image";
    for (int lao = 11; lao < 15; ++lao)
        EXPECT_TRUE(frame("0 arm lao " + std::to_string(lao) + " deg\n")) << lao;
    EXPECT_TRUE(frame("0 table 0 0 3 mm\n"));
    const Exercise::Snapshot moving = exercise.snapshot();
    int coarse = 0;
    while (frame("")) ASSERT_LT(++coarse, 30);
    EXPECT_GE(coarse, 1);
    EXPECT_LE(coarse * frame_time, 0.3);
    EXPECT_FALSE(frame("0 collimate 120 90 mm\n")) << "the collimator moves nothing";
    exercise.restore(moving);
    int again = 0;
    while (frame("")) ASSERT_LT(++again, 30);
    EXPECT_EQ(again, coarse);

    EXPECT_FALSE(frame("0 mode dsa\n0 arm lao 20 deg\n")) << "a mask is sharp at once";
    EXPECT_FALSE(frame("0 mode roadmap\n")) << "and so is what lies under its map";
    EXPECT_TRUE(frame("0 mode live\n"));
    frame("0 beam off\n0 arm lao 30 deg\n");
    for (int i = 0; i < 0.4 / frame_time; ++i) frame("");
    EXPECT_FALSE(frame("0 beam on\n")) << "it stopped while the beam was off";
}

TEST_F(StandMotionWithBody, ACoarseImageIsTheSameAfterASnapshot) {
    const scenario::Scenario scenario = test::small_scenario_with_patient();
    const auto turn = [](Exercise& exercise, int lao) {
        script::MoveArm move;
        move.lao = lao * geometry::degree;
        const std::vector<script::Command> now = {script::Beam{true}, move};
        exercise.next_frame(now);
    };
    Exercise one(scenario, true), other(scenario, true);
    for (int lao = 1; lao < 5; ++lao) turn(one, lao);
    other.restore(one.snapshot());
    EXPECT_EQ(one.image().pixels, other.image().pixels);
    turn(one, 6);
    turn(other, 6);
    EXPECT_EQ(one.image().pixels, other.image().pixels);
}

}  // namespace exercise
