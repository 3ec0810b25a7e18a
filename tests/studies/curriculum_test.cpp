/// Every exercise that ships: its solution is worth all points, forgives an inexact hand, and is clearly
/// better than senseless motion. What that means is author's, which `seldinger author` asks too.

#include <gtest/gtest.h>
#include <map>

#include "engine/author/attempt.h"
#include "engine/author/check.h"
#include "engine/exercise/exercise.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace {

using author::Attempt, exercise::Exercise;

const scenario::ExerciseFolders shipped(test::asset(""), {}, {});

std::vector<std::string> names_of_all() {
    std::vector<std::string> names;
    for (const scenario::ExerciseFiles& one : shipped.all()) names.push_back(one.name);
    return names;
}

class Curriculum : public testing::TestWithParam<std::string> {
protected:
    scenario::ExerciseFiles files = shipped.find(GetParam());
    scenario::Scenario scenario = test::shipped_scenario(GetParam());
    script::CommandScript solution = script::load_commands(files.solution);
    Exercise start{scenario, false, test::cache()};
};

/// Those with a grade: all but guided lessons.
class Graded : public Curriculum {};

std::vector<std::string> names_of_graded() {
    std::vector<std::string> names = names_of_all();
    std::erase_if(names, [](const auto& name) { return test::shipped_scenario(name).lesson.guided(); });
    return names;
}

}  // namespace

TEST_P(Curriculum, TheSolutionIsWorthAllPoints) {
    EXPECT_EQ(author::missing_of_lesson(files, scenario), std::vector<std::string>());
    EXPECT_EQ(author::faults_of_solution(scenario, author::attempt(start, solution, author::exact_hand, 0)),
              std::vector<std::string>());
    const scenario::Benchmark& skilled = scenario.lesson.benchmark;
    EXPECT_EQ(skilled.given(), !scenario.lesson.guided());
    if (skilled.given()) {
        EXPECT_EQ(skilled.scenario, scenario.content) << "of another state of the exercise";
    }
}

/// Amounts off by up to 5 %: all too much, all too little, and line by line at random.
TEST_P(Curriculum, TheSolutionForgivesFivePercent) {
    const auto attempts = author::trial(start, solution, author::usual_off);
    ASSERT_EQ(attempts->size(), 10u);
    for (const Attempt& one : *attempts) {
        EXPECT_TRUE(one.score.completed)
            << "hand " << one.hand << ": tip " << one.score.tip_to_target << " mm from the target";
        EXPECT_EQ(one.defects, std::vector<std::string>()) << "hand " << one.hand;
    }
}

TEST_P(Graded, ClumsyHandsAreWorthClearlyLess) {
    const std::vector<double> points = author::clumsy_points(start, scenario.lesson.benchmark);
    ASSERT_EQ(points.size(), author::clumsy_hands);
    for (std::size_t k = 0; k < points.size(); ++k)
        EXPECT_LE(points[k], author::most_clumsy_points) << "seed " << k + 1;
}

INSTANTIATE_TEST_SUITE_P(Shipped, Curriculum, testing::ValuesIn(names_of_all()),
                         [](const auto& one) { return one.param; });
INSTANTIATE_TEST_SUITE_P(Shipped, Graded, testing::ValuesIn(names_of_graded()),
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
