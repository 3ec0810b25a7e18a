/// Every patient that an exercise ships can be treated: a course to the target is found, and played.

#include <algorithm>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <map>

#include "engine/author/attempt.h"
#include "engine/exercise/exercise.h"
#include "engine/scenario/exercise_folders.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/studies/course_search.h"

namespace {

/// An exercise and one of its patients.
using OnePatient = std::pair<std::string, int>;

std::vector<OnePatient> all_patients() {
    std::vector<OnePatient> all;
    const scenario::ExerciseFolders shipped(test::asset(""), {}, {});
    for (const scenario::ExerciseFiles& one : shipped.all()) {
        const auto count = test::shipped_scenario(one.name).lesson.patients.size();
        for (std::size_t k = 0; k < count; ++k) all.emplace_back(one.name, static_cast<int>(k) + 2);
    }
    return all;
}

class PatientsOfExercises : public testing::TestWithParam<OnePatient> {};

}  // namespace

TEST_P(PatientsOfExercises, ACourseToTheTargetIsFoundAndPlayed) {
    const auto& [name, number] = GetParam();
    const scenario::Scenario scenario = scenario::load_scenario(
        test::asset("scenarios/" + name + ".toml"), test::asset("devices"), {}, std::to_string(number));
    const exercise::Exercise start(scenario, false, test::cache());
    const auto course = test::find_course(start);
    ASSERT_TRUE(course);
    exercise::Exercise again(start);
    const author::Attempt played =
        author::attempt(again, script::parse_commands(*course, "search"), author::exact_hand, 0);
    EXPECT_TRUE(played.score.completed) << *course;
    EXPECT_TRUE(played.defects.empty());
}

INSTANTIATE_TEST_SUITE_P(Shipped, PatientsOfExercises, testing::ValuesIn(all_patients()),
                         [](const auto& one) {
                             return fmt::format("{}_{}", one.param.first, one.param.second);
                         });

TEST(PatientsOfAllExercises, AtLeastSixExercisesHaveThreeOthers) {
    std::map<std::string, int> count;
    for (const auto& [name, number] : all_patients()) ++count[name];
    EXPECT_GE(std::ranges::count_if(count, [](const auto& one) { return one.second >= 3; }), 6);
}
