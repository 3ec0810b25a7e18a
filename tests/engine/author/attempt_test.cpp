#include "engine/author/attempt.h"

#include <cmath>

#include "engine/author/check.h"
#include "engine/author/solution.h"
#include "tests/engine/fixtures.h"

namespace author {
namespace {

using exercise::Exercise;

const std::string pushes = "0 beam on\n1..20 advance 2 mm\n21..30 advance 1 mm\n40 end\n";

script::CommandScript script_of(const std::string& text) {
    return script::parse_commands(text, "run.gw");
}

Exercise small_exercise(const std::string& toml = test::small_toml) {
    return {test::small_scenario(toml), exercise::Pictures::None};
}

/// The small scenario with a target on its way, of that radius [mm].
std::string with_target(double radius) {
    return test::small_toml_with("name = \"end\"\nradius_mm = 3.0",
                                 "centre_mm = [50.0, 8.0, 0.0]\nradius_mm = " + std::to_string(radius));
}

}  // namespace

TEST(Attempt, TheExactHandDoesWhatTheScriptSays) {
    Exercise exercise = small_exercise();
    const Attempt made = attempt(exercise, script_of(pushes), exact_hand, 0.05);
    EXPECT_NEAR(made.score.wire_travel, 50, 1e-9);
    EXPECT_EQ(made.defects, std::vector<std::string>());
    EXPECT_LE(made.nearest, made.smallest_radius);
}

TEST(Attempt, HandsAreOffByAsMuchAsIsAskedForAndEachLineByItsOwnFraction) {
    const auto travel = [](unsigned hand, double off) {
        Exercise exercise = small_exercise();
        return attempt(exercise, script_of("1..5 advance 2 mm\n6..10 withdraw 1 mm\n"), hand, off).score;
    };
    EXPECT_NEAR(travel(1, 0.1).wire_travel, 16.5, 1e-9);
    EXPECT_NEAR(travel(2, 0.1).wire_travel, 13.5, 1e-9);
    bool differs = false;
    for (unsigned hand = 3; hand <= last_hand; ++hand) {
        const exercise::Score score = travel(hand, 0.1);
        EXPECT_GE(score.advanced, 9);
        EXPECT_LE(score.advanced, 11);
        EXPECT_GE(score.withdrawn, 4.5);
        EXPECT_LE(score.withdrawn, 5.5);
        differs |= std::abs(score.advanced / 10 - score.withdrawn / 5) > 0.01;
        EXPECT_EQ(score.advanced, travel(hand, 0.1).advanced);  // the same every time
    }
    EXPECT_TRUE(differs);
}

/// A little larger a target is reached, a little smaller a one is not: at every speed and hold.
TEST(Attempt, TheSmallestRadiusIsTheOneThatDecides) {
    for (const double hold : {0.0, 0.1, 0.2, 0.5, 1.0})
        for (const char* push : {"0.7", "1", "1.5"}) {
            const std::string text = std::string("0 beam on\n1..45 advance ") + push + " mm\n50 end\n",
                              held = "hold_s = " + std::to_string(hold);
            const auto reached_with = [&](double radius) {
                Exercise exercise = small_exercise(test::replaced(with_target(radius), "hold_s = 0.2", held));
                return attempt(exercise, script_of(text), exact_hand, 0);
            };
            const double smallest = reached_with(1).smallest_radius;
            SCOPED_TRACE(testing::Message() << "hold " << hold << ", push " << push << ": " << smallest);
            ASSERT_TRUE(std::isfinite(smallest));
            EXPECT_TRUE(reached_with(smallest + 2e-6).score.completed);
            EXPECT_FALSE(reached_with(smallest - 2e-6).score.completed);
        }
}

TEST(Trial, LeavesTheStartAsItWasAndDoesNotDependOnJobs) {
    const Exercise start = small_exercise();
    const auto before = start.snapshot().state;
    TrialOptions one, two;
    one.jobs = 1;
    two.jobs = 3;
    const auto a = trial(start, script_of(pushes), usual_off, one),
               b = trial(start, script_of(pushes), usual_off, two);
    ASSERT_EQ(a->size(), last_hand);
    for (std::size_t k = 0; k < a->size(); ++k) {
        EXPECT_EQ((*a)[k].hand, k + 1);
        EXPECT_EQ((*a)[k].nearest, (*b)[k].nearest);
        EXPECT_EQ((*a)[k].score.wire_travel, (*b)[k].score.wire_travel);
    }
    EXPECT_EQ(start.snapshot().state, before);
}

TEST(Trial, ItsRadiusIsTheSmallestThatAllReach) {
    const auto all_with = [](double radius) {
        return *trial(small_exercise(with_target(radius)),
                      script_of("0 beam on\n1..25 advance 1 mm\n40 end\n"), usual_off);
    };
    const double radius = forgiving_radius(all_with(1));
    EXPECT_FALSE(all_reach(all_with(radius - 1e-4)));
    EXPECT_TRUE(all_reach(all_with(radius + 1e-4)));
}

TEST(Trial, TheWidestFractionIsTheLastAtWhichAllReach) {
    const Exercise start = small_exercise(with_target(4));
    const script::CommandScript script = script_of("0 beam on\n1..25 advance 1.2 mm\n40 end\n");
    const double widest = *widest_off(start, script);
    ASSERT_GT(widest, 0.005);
    ASSERT_LT(widest, widest_tried);
    for (double off = 0.01; off < widest + 0.005; off += 0.01)
        EXPECT_TRUE(all_reach(*trial(start, script, off))) << off;
    EXPECT_FALSE(all_reach(*trial(start, script, widest + 0.01)));
    EXPECT_EQ(widest_off(start, script_of("0 beam on\n1 advance 1 mm\n")), 0.0);  // never reaches
}

TEST(Trial, CanBeInterrupted) {
    TrialOptions options;
    options.interrupted = [] { return true; };
    EXPECT_FALSE(trial(small_exercise(), script_of(pushes), usual_off, options));
    EXPECT_FALSE(widest_off(small_exercise(), script_of(pushes), options));
    EXPECT_FALSE(solution_of(script_of(pushes), "x.gw", small_exercise(), options));
}

TEST(Solution, IsInRangesAndReaches) {
    std::string recording = "0 beam on\n";
    for (int frame = 1; frame <= 60; ++frame)
        recording +=
            std::to_string(frame) + " advance " + std::to_string(1 + 0.01 * (frame % 7 - 3)) + " mm\n";
    const auto made = solution_of(script_of(recording), "x.gw", small_exercise());
    EXPECT_TRUE(made->exact.score.completed);
    EXPECT_LE(made->script.commands.size(), 61u);
    EXPECT_LE(std::ranges::count(made->text, '\n'), 8) << made->text;
    EXPECT_EQ(made->script.last_frame(10), 70);
}

TEST(Solution, DropsWhatComesToNothingOnlyWhereItIsReachedWithoutThat) {
    const std::string there = "0 beam on\n1..60 advance 1 mm\n";
    const auto made =
        solution_of(script_of("0 beam on\n1..9 advance 1 mm\n12..20 withdraw 1 mm\n30..89 advance 1 mm\n"),
                    "x.gw", small_exercise());
    EXPECT_EQ(made->dropped, 1u);
    EXPECT_EQ(made->text.find("withdraw"), std::string::npos) << made->text;
    EXPECT_TRUE(made->exact.score.completed);
    // The target is a place that is visited and left again: both motions stay.
    const auto visited =
        solution_of(script_of("0 beam on\n1..30 advance 1 mm\n40..69 withdraw 1 mm\n80 end\n"), "x.gw",
                    small_exercise(with_target(4)));
    EXPECT_EQ(visited->dropped, 0u);
    EXPECT_NE(visited->text.find("withdraw"), std::string::npos);
}

TEST(Solution, OfWhatDoesNotReachOrIsOfAnotherExerciseIsRefused) {
    test::expect_refusal([] { solution_of(script_of("1 advance 1 mm\n"), "x.gw", small_exercise()); },
                         "it does not reach the target: its tip is ");
    script::CommandScript recording = script_of(pushes);
    recording.origin.emplace().scenario = "renal";
    test::expect_refusal([&] { require_recording_of(recording, "small"); },
                         "it is a recording of 'renal'; expected one of 'small'");
    test::expect_refusal([&] { require_recording_of(script_of("0 beam on\n"), "small"); },
                         "expected motions of a device, found none");
    test::expect_refusal([&] { require_recording_of(script_of("1 advance 1 mm\n2 reset\n"), "small"); },
                         "found a reset");
    recording.origin->scenario = "small";
    EXPECT_NO_THROW(require_recording_of(recording, "small"));
}

TEST(Standard, TellsWhatASolutionLacks) {
    const scenario::Scenario small = test::small_scenario();
    Exercise exercise(small, exercise::Pictures::None);
    const Attempt short_of = attempt(exercise, script_of("1 advance 1 mm\n"), exact_hand, 0);
    test::expect_said(faults_of_solution(small, short_of).at(0), "the target is not reached");
    EXPECT_EQ(missing_of_lesson({"small", "small.toml", {}, {}}, small).size(), 6u);
    // A benchmark that is far above the solution is told, one that is below it costs points.
    scenario::Scenario graded = small;
    Exercise again(small, exercise::Pictures::None);
    const Attempt made = attempt(again, script_of("0 beam on\n1..52 advance 1 mm\n70 end\n"), exact_hand, 0);
    ASSERT_TRUE(made.score.completed);
    const auto faults = [&](double times) {
        graded.lesson.benchmark = benchmark_for(small, made.score);
        graded.lesson.benchmark.completed_after.values[0] *= times;
        graded.lesson.benchmark.wire_travel.values[0] *= times;
        std::string all;
        for (const std::string& one : faults_of_solution(graded, made)) all += one + "\n";
        return all;
    };
    EXPECT_EQ(faults(1.02), "");
    test::expect_said(faults(6), "the benchmark's completed_after_s of");
    test::expect_said(faults(4), "the benchmark's wire_travel_mm of");
    test::expect_said(faults(0.1), "points by the benchmark");
}

}  // namespace author
