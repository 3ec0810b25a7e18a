#pragma once
/// A folder of recordings as a teacher sees it: learners, exercises, attempts, best and last; and what
/// the course asks of the learners.

#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/handling.h"
#include "engine/exercise/worst_treatment.h"
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

/// As a page keeps it.
struct CourseTreatment : exercise::WorstTreatment {};

/// One attempt; a recording has several where it was reset.
struct CourseRow {
    std::string file;
    std::string learner;   // empty = nobody's
    std::string exercise;  // name of the scenario
    int level = 0;
    int attempt = 0;      // of this learner at this exercise, from 1
    std::string problem;  // why it does not count; empty = it does
    bool reached = false;
    std::optional<double> points;  // empty without a benchmark
    std::optional<double> time;    // to the target [s]
    double beam = 0;               // [s]
    double contrast = 0;           // [ml]
    double travel = 0;             // [mm]
    double force = 0;              // largest of a joint [N]
    int wrong_entries = 0;
    std::array<int, exercise::handling_error_kinds> errors = {};
    std::string title;                   // of the exercise
    std::optional<Day> day;              // on which it was begun, as it says, or its file was last written
    std::optional<double> air_kerma;     // K_a,r [mGy]
    std::optional<double> area_product;  // P_KA [Gy·cm²]
    int angiograms = 0;
    std::vector<double> costs;  // points, of each of exercise::measures(); empty without a benchmark
    bool blind = false;         // the lines of what looking costs are lost whole: nothing was looked at
    /// Of a guided lesson: steps done, and those that there are.
    std::optional<std::pair<int, int>> steps;
    std::optional<CourseTreatment> treatment;  // empty where there was nothing to treat
    std::string patient;                       // as Scenario has it; empty = the first
    std::string teacher;                       // what a teacher showed, hid or paused in it
    std::string debriefing;                    // its page, as a link from the course's; empty = there is none

    int all_errors() const;
    /// Whether the target was reached, with at least so many points where the exercise has a benchmark, and
    /// with all steps in a guided lesson.
    bool passes(double pass) const {
        return reached && (!points || *points >= pass) && (!steps || steps->first == steps->second);
    }
};

struct CourseOptions {
    /// The scenario of a recording. Throws InputError where there is none.
    std::function<scenario::Scenario(const script::CommandScript&)> scenario;
    /// Why a recording of these bytes does not count, as for want of a signature; empty where it does.
    /// Without it every recording counts.
    std::function<std::string(std::string_view)> distrust = {};
    anatomy::ModelCache cache;
    std::string program_hash;  // of the program that computes: its results are kept in the cache
    int jobs = 2;
    std::function<void(std::size_t done, std::size_t of)> progress;
    std::function<bool()> interrupted;
};

/// The attempts of the files, in their order. One that cannot be played, or that leads to other states than
/// it states, has a problem and no figures. Figures are kept in the cache's folder, so that a second look, or
/// one after an interruption, costs nothing. Empty: interrupted.
std::optional<std::vector<CourseRow>> course_of(std::span<const std::filesystem::path>, const CourseOptions&);

/// The page of a recording's debriefing: beside the recording, or where `out` mirrors `folder`, whichever is
/// there; the latter where none is.
std::filesystem::path debriefing_page(const std::filesystem::path& recording,
                                      const std::filesystem::path& folder, const std::filesystem::path& out);
/// A link from a page in `folder`, as a browser reads it.
std::string link_to(const std::filesystem::path& file, const std::filesystem::path& folder);

/// A line for each attempt; columns are only ever added at the end.
std::string course_csv(std::span<const CourseRow>, const CoursePlan&);
/// The same as JSON: an object for each attempt, with the columns as keys.
std::string course_json(std::span<const CourseRow>, const CoursePlan&);

}  // namespace debrief
