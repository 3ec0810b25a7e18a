#include "engine/author/standard.h"

#include <algorithm>
#include <fmt/format.h>
#include <random>
#include <span>

#include "engine/exercise/grade.h"

namespace author {
namespace {

double clumsy_attempt(const exercise::Exercise& start, const scenario::Benchmark& skilled, unsigned seed) {
    exercise::Exercise exercise(start);
    std::mt19937 random(seed);
    const auto pick = [&random](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const double rate = exercise.simulation().scenario().frame_rate;
    const int frames = std::min(600, static_cast<int>(3 * skilled.completed_after.mean() * rate));
    double push = 0, turn = 0;
    for (int frame = 0; frame < frames && !exercise.time_is_up(); ++frame) {
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
    return exercise::grade(exercise.finish(), skilled).points;
}

}  // namespace

std::vector<std::string> missing_of_lesson(const scenario::ExerciseFiles& files,
                                           const scenario::Scenario& s) {
    std::vector<std::string> missing;
    const scenario::Lesson& lesson = s.lesson;
    if (lesson.level < 1) missing.push_back("[lesson] level");
    if (lesson.briefing.empty()) missing.push_back("[lesson] briefing");
    if (lesson.hints.empty()) missing.push_back("[lesson] hints");
    if (lesson.views.empty()) missing.push_back("[[lesson.view]]");
    if (!lesson.benchmark.given() && !lesson.guided())
        missing.push_back(fmt::format("{} of {}", files.name, scenario::benchmark_file));
    if (files.picture.empty()) missing.push_back(files.name + ".png");
    return missing;
}

std::vector<std::string> faults_of_solution(const scenario::Scenario& s, const Attempt& made) {
    std::vector<std::string> faults = made.defects;
    const exercise::Score& score = made.score;
    if (!score.completed)
        faults.push_back(
            fmt::format("the target is not reached: the tip is {:.2f} mm away at its nearest", made.nearest));
    for (const exercise::HandlingErrorMark& mark : score.handling_errors)
        faults.push_back(fmt::format("frame {}: {}", mark.first,
                                     exercise::handling_error_texts[static_cast<std::size_t>(mark.kind)]));
    if (const int wrong = score.wrong_entries(); wrong > 0)
        faults.push_back(fmt::format("{} entries into wrong branches", wrong));
    const scenario::Benchmark& skilled = s.lesson.benchmark;
    if (!skilled.given() || !score.completed) return faults;
    if (const double points = exercise::grade(score, skilled).points; points < least_points_of_solution)
        faults.push_back(fmt::format("it is worth {:.1f} points by the benchmark, {:g} or more are right",
                                     points, least_points_of_solution));
    // The benchmark is of this way: a script can be up to four times as fast as keys are.
    const auto is_near = [&](const char* key, double mean, double most) {
        if (mean >= most)
            faults.push_back(
                fmt::format("the benchmark's {} of {:.4g} is far above the solution's; less than "
                            "{:.4g} is near it",
                            key, mean, most));
    };
    is_near("completed_after_s", skilled.completed_after.mean(), 4 * *score.completed_after + 2);
    is_near("wire_travel_mm", skilled.wire_travel.mean(), 1.1 * score.wire_travel + 5);
    return faults;
}

scenario::Benchmark benchmark_for(const scenario::Scenario& s, const exercise::Score& solution) {
    if (s.lesson.benchmark.given()) return s.lesson.benchmark;
    return exercise::benchmark_of(std::span(&solution, 1), "the solution alone", s.content);
}

std::vector<double> clumsy_points(const exercise::Exercise& start, const scenario::Benchmark& skilled) {
    std::vector<double> points;
    for (unsigned seed = 1; seed <= clumsy_hands; ++seed)
        points.push_back(clumsy_attempt(start, skilled, seed));
    return points;
}

}  // namespace author
