/// A search finds a course where there is one, and says so where there is none.

#include "engine/author/search.h"

#include <gtest/gtest.h>

#include "engine/author/attempt.h"
#include "tests/engine/fixtures.h"

namespace author {
namespace {

TEST(Search, ItsCourseReachesTheTargetWhenItIsPlayed) {
    const exercise::Exercise start(test::small_scenario(), false);
    const auto course = find_course(start);
    ASSERT_TRUE(course);
    exercise::Exercise again(start);
    const Attempt played = attempt(again, course->script, exact_hand, 0);
    EXPECT_TRUE(played.score.completed) << course->text;
    EXPECT_GT(course->tried, 0);
    EXPECT_EQ(find_course(start)->text, course->text);
    EXPECT_EQ(start.frame(), -1);
}

TEST(Search, ATargetBeyondTheWiresReachIsNotFound) {
    scenario::Scenario s = test::small_scenario();
    s.wire().device.length = s.wire().inserted + 10;
    SearchOptions options;
    options.most_steps = 40;
    EXPECT_FALSE(find_course(exercise::Exercise(s, false), options));
}

TEST(Search, ItEndsWhenItIsAskedTo) {
    SearchOptions options;
    options.interrupted = [] { return true; };
    EXPECT_FALSE(find_course(exercise::Exercise(test::small_scenario(), false), options));
}

}  // namespace
}  // namespace author
