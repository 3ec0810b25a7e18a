#pragma once
/// What a course asks of its learners: `course.toml` in the folder of recordings.
///
///     schema = 1
///     title = "Angiography, autumn 2026"
///     pass = 70                        # points; else exercise::pass_mark
///     idle_days = 14                   # who has not trained for as long is told
///     learners = ["Ada", "Ben"]        # who is expected
///     [[exercise]]
///     name = "straight"
///     pass = 60                        # of this exercise
///     due = 2026-12-24

#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/scenario/scenario.h"

namespace debrief {

/// A day of the calendar where the computer stands.
using Day = std::chrono::sys_days;
/// "2026-12-24".
std::string day_text(Day);
Day day_of(std::chrono::system_clock::time_point);

/// The scenario of a name. Throws InputError where there is none.
using FindScenario = std::function<scenario::Scenario(const std::string& name)>;

struct PlannedExercise {
    std::string name, title;
    int level = 0;                // 0 = outside the curriculum
    double pass = 0;              // points
    std::optional<Day> due = {};  // the last day that is in time
};

struct CoursePlan {
    std::string file;   // that it was read from; empty: everything is as usual
    std::string title;  // empty: the folder's name
    std::vector<PlannedExercise> exercises;
    bool lists_exercises = false;  // others are outside the course
    std::vector<std::string> learners;
    double pass = 0;
    int idle_days = 14;

    const PlannedExercise* find(const std::string& exercise) const;
};

inline constexpr const char* course_file = "course.toml";

/// The plan without a file: those of the exercises, which are in order, that have a level.
CoursePlan usual_plan(std::span<const scenario::Scenario>);
/// The plan in the text; where it lists no exercises they are those of `usual`. Throws InputError that lists
/// everything wrong, a line each.
CoursePlan parse_plan(const std::string& toml, const std::string& file, const FindScenario&,
                      const CoursePlan& usual);

}  // namespace debrief
