/// Every exercise that ships: its solution is worth all points, forgives an inexact hand, and is clearly
/// better than senseless motion.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/grade.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace {

using exercise::Exercise, exercise::Score;

const std::string asset_folder = SELDINGER_SOURCE "/assets/";

std::vector<std::string> names_of_all() {
    std::vector<std::string> names;
    for (const auto& file : scenario::shipped_scenarios(asset_folder + "scenarios"))
        names.push_back(file.stem());
    return names;
}

class Curriculum : public testing::TestWithParam<std::string> {
protected:
    scenario::Scenario scenario = test::shipped_scenario(GetParam());
    script::CommandScript solution = script::load_commands(asset_folder + "scripts/" + GetParam() + ".gw");
    Exercise exercise{scenario, false, test::cache()};
    Exercise::Snapshot start = exercise.snapshot();

    /// Plays the solution, the amounts of each line times `factor` of it.
    template <class Factor>
    Score play(const Factor& factor) {
        exercise.restore(start);
        for (int frame = 0; frame <= solution.last_frame(10) && !exercise.time_is_up(); ++frame) {
            std::vector<script::Command> commands;
            for (const script::TimedCommand& timed : solution.at(frame)) {
                script::Command command = timed.command;
                const double by = factor(timed.place.line);
                if (auto* advance = std::get_if<script::Advance>(&command)) advance->length *= by;
                if (auto* withdraw = std::get_if<script::Withdraw>(&command)) withdraw->length *= by;
                if (auto* rotate = std::get_if<script::Rotate>(&command)) rotate->angle *= by;
                commands.push_back(std::move(command));
            }
            const exercise::StepReport report = exercise.next_frame(commands).motion;
            EXPECT_TRUE(physics::validate(exercise.simulation().wire()).empty()) << "frame " << frame;
            EXPECT_TRUE(report.settling || report.relax.newton_steps == 0 || report.relax.at_rest())
                << "frame " << frame;
            EXPECT_FALSE(report.buckled || report.too_thick || report.refused) << "frame " << frame;
        }
        return exercise.finish();
    }
};

}  // namespace

TEST_P(Curriculum, TheSolutionIsWorthAllPoints) {
    ASSERT_GE(scenario.lesson.level, 1);
    EXPECT_FALSE(scenario.lesson.briefing.empty());
    EXPECT_FALSE(scenario.lesson.hints.empty());
    EXPECT_FALSE(scenario.lesson.views.empty());
    const scenario::Benchmark& skilled = scenario.lesson.benchmark;
    ASSERT_TRUE(skilled.given());
    EXPECT_EQ(skilled.scenario, scenario.content) << "of another state of the exercise";
    EXPECT_TRUE(std::filesystem::exists(asset_folder + "scenarios/" + GetParam() + ".png"));
    const Score score = play([](int) { return 1.0; });
    ASSERT_TRUE(score.completed) << "tip " << score.tip_to_target << " mm from the target";
    for (const exercise::MishapMark& mark : score.mishaps)
        ADD_FAILURE() << exercise::mishap_texts[static_cast<std::size_t>(mark.kind)] << ", frame "
                      << mark.first;
    EXPECT_EQ(score.wrong_entries(), 0);
    // What is done once the target is reached counts too.
    EXPECT_GE(exercise::grade(score, skilled).points, 97);
    // The benchmark is near the solution: it is as a hand at the keys makes it.
    EXPECT_LT(skilled.completed_after.mean(), 2.5 * *score.completed_after + 2);
    EXPECT_NEAR(skilled.wire_travel.mean(), score.wire_travel, 0.1 * score.wire_travel + 5);
}

/// Amounts off by up to 5 %: all too much, all too little, and line by line at random.
TEST_P(Curriculum, TheSolutionForgivesFivePercent) {
    constexpr double off = 0.05;
    for (unsigned seed = 1; seed <= 10; ++seed) {
        std::mt19937 random(seed);
        std::map<int, double> factors;  // by line
        const Score score = play([&](int line) {
            if (seed < 3) return seed == 1 ? 1 + off : 1 - off;
            const auto [at, fresh] = factors.try_emplace(line, 1.0);
            if (fresh) at->second = 1 + off * (2 * std::ldexp(static_cast<double>(random()), -32) - 1);
            return at->second;
        });
        EXPECT_TRUE(score.completed) << "seed " << seed << ": tip " << score.tip_to_target
                                     << " mm from the target";
    }
}

TEST_P(Curriculum, ClumsyHandsAreWorthClearlyLess) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
        exercise.restore(start);
        std::mt19937 random(seed);
        const auto pick = [&random](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
        const int frames = static_cast<int>(3 * scenario.lesson.benchmark.completed_after.mean() * scenario.frame_rate);
        double push = 0, turn = 0;
        for (int frame = 0; frame < std::min(frames, 600) && !exercise.time_is_up(); ++frame) {
            std::vector<script::Command> commands;
            if (frame % 20 == 0) {
                push = pick(10) - 4;
                turn = 0.1 * (pick(7) - 3);
                commands.push_back(script::Beam{pick(3) > 0});
            }
            if (push > 0) commands.push_back(script::Advance{push});
            if (push < 0) commands.push_back(script::Withdraw{-push});
            if (turn != 0) commands.push_back(script::Rotate{turn});
            exercise.next_frame(commands);
            if (exercise.score().completed) break;
        }
        const double points = exercise::grade(exercise.finish(), scenario.lesson.benchmark).points;
        EXPECT_LE(points, 75) << "seed " << seed;
    }
}

INSTANTIATE_TEST_SUITE_P(Shipped, Curriculum, testing::ValuesIn(names_of_all()),
                         [](const auto& one) { return one.param; });

TEST(CurriculumAsAWhole, HasTwelveExercisesInFourLevels) {
    std::map<int, int> of_level;
    for (const std::string& name : names_of_all()) ++of_level[test::shipped_scenario(name).lesson.level];
    EXPECT_EQ(of_level.count(0), 0u);
    int all = 0;
    for (const auto& [level, count] : of_level) all += count;
    EXPECT_GE(all, 12);
    for (int level = 1; level <= scenario::Lesson::levels; ++level) EXPECT_GE(of_level[level], 2) << level;
}
