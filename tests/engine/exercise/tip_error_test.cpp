/// Segments that keep a stated error of the tip: [chain] tip_error_mm.

#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

scenario::Scenario keeping(const std::string& line, const std::string& relaxer = "[relaxer]") {
    std::string text = test::small_toml_with("[chain]", "[chain]\n" + line);
    return test::small_scenario(text.replace(text.find("[relaxer]"), 9, relaxer));
}

script::Command hand(int frame) {
    if (frame % 12 == 8) return script::Withdraw{3};
    return script::Advance{1.5};
}

void play(Simulation& simulation, int from, int frames) {
    for (int frame = from; frame < from + frames; ++frame) {
        if (frame % 4 != 3) simulation.apply(hand(frame));
        if (frame % 3 == 0) simulation.apply(script::Rotate{0.1});
        simulation.step();
    }
}

}  // namespace

TEST(TipError, SegmentsKeepItWhereUniformOnesDoNot) {
    constexpr double tolerance = 0.01;  // [mm]
    Simulation plain(keeping("")), kept(keeping("tip_error_mm = 0.01"));
    int rests = 0, within = 0, plain_within = 0;
    for (int frame = 0; frame < 40; ++frame) {
        play(plain, frame, 1);
        play(kept, frame, 1);
        const auto error = kept.tip_error(), of_plain = plain.tip_error();
        if (!error || !of_plain) continue;
        ++rests;
        within += error->tip <= tolerance;
        plain_within += of_plain->tip <= tolerance;
        ASSERT_TRUE(physics::validate(kept.wire()).empty());
    }
    EXPECT_GE(rests, 35);
    EXPECT_GE(within, 0.9 * rests) << within << " of " << rests;
    EXPECT_LE(plain_within, 0.7 * rests) << "whole segments are as good: this tests nothing";
    EXPECT_GT(kept.wire().segments(), plain.wire().segments());
    EXPECT_DOUBLE_EQ(kept.inserted(), plain.inserted());
}

TEST(TipError, APlayIsTheSameToTheBitAgainAndFromAnyCopyAndSnapshot) {
    for (const int budget : {20000, 300}) {
        scenario::Scenario scenario = keeping("tip_error_mm = 0.004");
        scenario.budget.updates = budget;
        Exercise exercise(scenario, false), other(scenario, false);
        Simulation again(scenario);
        for (int frame = 0; frame < 36; ++frame) {
            std::vector<script::Command> commands;
            if (frame % 4 != 3) commands.push_back(hand(frame));
            const Simulation copy(exercise.simulation());
            other.restore(exercise.snapshot());
            Simulation from_copy(copy);
            for (const script::Command& command : commands) again.apply(command), from_copy.apply(command);
            exercise.next_frame(commands);
            other.next_frame(commands);
            again.step();
            from_copy.step();
            const auto hash = exercise.simulation().state_hash();
            ASSERT_EQ(again.state_hash(), hash) << budget << ", " << frame;
            ASSERT_EQ(from_copy.state_hash(), hash) << budget << ", " << frame;
            ASSERT_EQ(other.simulation().state_hash(), hash) << budget << ", " << frame;
            ASSERT_EQ(other.snapshot().state, exercise.snapshot().state) << budget << ", " << frame;
        }
        bool pieces = false;
        for (int j = 1; j < again.wire().segments(); ++j) pieces = pieces || again.wire().within_a_segment(j);
        EXPECT_TRUE(pieces);
        const auto hash = again.state_hash();
        again.reset();
        EXPECT_NE(again.state_hash(), hash);
    }
}

TEST(TipError, IsKeptInAnExerciseWithFrictionAndVesselsThatGiveWay) {
    scenario::Scenario scenario = test::shipped_scenario("iliac_aorta");
    scenario.tip_error = 0.05;
    Simulation simulation(scenario, test::cache());
    int rests = 0, within = 0;
    for (int frame = 0; frame < 40; ++frame) {
        simulation.apply(script::Advance{2});
        const StepReport report = simulation.step();
        EXPECT_LE(report.relax.updates, 2 * scenario.budget.updates) << "frame " << frame;
        ASSERT_TRUE(physics::validate(simulation.wire()).empty()) << "frame " << frame;
        const auto error = simulation.tip_error();
        rests += simulation.readings().at_rest && simulation.readings().strict_minimum;
        within += error && error->tip <= 0.05;
    }
    EXPECT_GE(rests, 30);
    EXPECT_GE(within, 0.7 * rests) << within << " of " << rests;
}

TEST(TipError, WhatCannotBeKeptIsRefused) {
    const auto refused = [](const std::string& line, const std::string& relaxer = "[relaxer]") {
        return test::refusal([&] { keeping(line, relaxer); });
    };
    EXPECT_EQ(refused("tip_error_mm = 0.01"), "");
    for (const char* value : {"0", "0.0", "-0.01", "nan", "inf", "-inf", "1e9", "\"auto\"", "true", "[0.1]"})
        test::expect_said(refused(std::string("tip_error_mm = ") + value), "tip_error_mm");
    for (const char* kind : {"segment", "first-order", "combined", "konings"})
        test::expect_said(refused("tip_error_mm = 0.01", std::string("[relaxer]\nkind = \"") + kind + "\""),
                          "only the relaxer \"global\"");
    test::expect_said(refused("tip_error_mm = 0.01\nadaptive = true"), "either adaptive");
    scenario::Scenario wrong = keeping("");
    for (const double value : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
        wrong.tip_error = value;
        EXPECT_FALSE(scenario::problems(wrong).empty()) << value;
    }
}

}  // namespace exercise
