#include "engine/debrief/course_learner.h"

#include <algorithm>
#include <fmt/format.h>
#include <string_view>

#include "engine/exercise/grade.h"

namespace debrief {
namespace {

using exercise::HandlingError;
using Rows = std::span<const CourseRow* const>;

constexpr std::size_t first_injury = static_cast<std::size_t>(HandlingError::Dissection);
static_assert(first_injury + 2 == exercise::handling_error_kinds, "injuries are the last kinds");

/// The most frequent kind of error from `first` to before `last`, with its advice.
Costly most_frequent(Rows rows, std::size_t first, std::size_t last) {
    std::array<int, exercise::handling_error_kinds> sum = {};
    for (const CourseRow* row : rows)
        for (std::size_t k = first; k < last; ++k) sum[k] += row->errors[k];
    const auto most = std::max_element(sum.begin() + static_cast<std::ptrdiff_t>(first),
                                       sum.begin() + static_cast<std::ptrdiff_t>(last));
    if (*most == 0) return {};
    const auto kind = static_cast<std::size_t>(most - sum.begin());
    return {fmt::format("{} ({} time{})", exercise::handling_error_texts[kind], *most, *most == 1 ? "" : "s"),
            exercise::handling_error_advice[kind], 0};
}

double cost_of_injuries(const CourseRow& row) {
    return row.errors[first_injury] * exercise::points_of_dissection +
           row.errors[first_injury + 1] * exercise::points_of_perforation;
}

/// The lines of the grade, points of all rows together.
std::vector<Costly> lines_of(Rows rows) {
    std::vector<Costly> lines;
    Costly unseen{"Going without looking", exercise::blind_advice, 0};
    const std::span<const exercise::Measure> measures = exercise::measures();
    for (std::size_t k = 0; k < measures.size(); ++k) {
        Costly line{measures[k].name, measures[k].advice, 0};
        for (const CourseRow* row : rows)
            (row->blind && measures[k].of_looking ? unseen : line).points += row->costs[k];
        if (std::string_view(measures[k].id) == "errors")
            if (Costly errors = most_frequent(rows, 0, first_injury); !errors.what.empty())
                line = {fmt::format("{}, most of all: {}", line.what, errors.what), errors.advice,
                        line.points};
        lines.push_back(std::move(line));
    }
    Costly injuries = most_frequent(rows, first_injury, exercise::handling_error_kinds);
    for (const CourseRow* row : rows) injuries.points += cost_of_injuries(*row);
    lines.push_back(std::move(unseen));
    lines.push_back(std::move(injuries));
    return lines;
}

void add(LearnerCourse& learner, const CourseRow& row, const CoursePlan& plan) {
    learner.attempts.push_back(&row);
    const PlannedExercise* exercise = plan.find(row.exercise);
    if (!exercise) return;
    Standing& standing = learner.exercises[static_cast<std::size_t>(exercise - plan.exercises.data())];
    standing.attempts.push_back(&row);
    standing.last = row.points;
    if (row.points) standing.best = std::max(standing.best.value_or(0), *row.points);
    standing.passed = standing.passed || row.passes(exercise->pass);
}

}  // namespace

const Standing* LearnerCourse::next() const {
    const auto found = std::ranges::find_if(exercises, [](const Standing& one) { return !one.passed; });
    return found == exercises.end() ? nullptr : &*found;
}

std::vector<const Standing*> LearnerCourse::overdue(Day today) const {
    std::vector<const Standing*> late;
    for (const Standing& standing : exercises)
        if (standing.overdue(today)) late.push_back(&standing);
    return late;
}

std::optional<int> LearnerCourse::idle(Day today) const {
    std::optional<Day> last;
    for (const CourseRow* row : attempts)
        if (row->day) last = std::max(last.value_or(*row->day), *row->day);
    if (!last) return std::nullopt;
    return static_cast<int>((today - *last).count());
}

std::vector<Falling> LearnerCourse::falling() const {
    std::vector<Falling> all;
    for (const Standing& standing : exercises) {
        std::vector<double> points;
        for (const CourseRow* row : standing.attempts)
            if (row->points) points.push_back(*row->points);
        if (points.size() < 3) continue;
        const double *first = points.data() + points.size() - 3, *second = first + 1, *third = first + 2;
        if (*second < *first && *third < *second && *third <= *first - clear_fall)
            all.push_back({standing.exercise, {*first, *second, *third}});
    }
    return all;
}

std::vector<Costly> LearnerCourse::costly() const {
    Rows recent = attempts;
    recent = recent.last(std::min(recent.size(), recent_attempts));
    std::vector<const CourseRow*> graded;
    for (const CourseRow* row : recent)
        if (row->costs.size() == exercise::measures().size()) graded.push_back(row);
    if (graded.empty()) {
        Costly errors = most_frequent(recent, 0, exercise::handling_error_kinds);
        return errors.what.empty() ? std::vector<Costly>() : std::vector<Costly>{errors};
    }
    std::vector<Costly> lines = lines_of(graded);
    for (Costly& line : lines) line.points /= static_cast<double>(graded.size());
    std::erase_if(lines, [](const Costly& line) { return line.points < least_cost; });
    std::ranges::stable_sort(lines, std::ranges::greater(), &Costly::points);
    if (lines.size() > most_costly) lines.resize(most_costly);
    return lines;
}

std::vector<LearnerCourse> learners_of(std::span<const CourseRow> rows, const CoursePlan& plan) {
    std::vector<std::string> others;
    for (const CourseRow& row : rows)
        if (row.problem.empty()) others.push_back(row.learner);
    std::ranges::sort(others);
    others.erase(std::unique(others.begin(), others.end()), others.end());
    std::vector<LearnerCourse> all;
    const auto take = [&](const std::string& name, bool expected) {
        LearnerCourse learner{name, expected, {}, {}};
        for (const PlannedExercise& exercise : plan.exercises)
            learner.exercises.push_back({&exercise, {}, {}, {}, false});
        for (const CourseRow& row : rows)
            if (row.problem.empty() && row.learner == name) add(learner, row, plan);
        all.push_back(std::move(learner));
    };
    for (const std::string& name : plan.learners) take(name, true);
    for (const std::string& name : others)
        if (std::ranges::find(plan.learners, name) == plan.learners.end()) take(name, plan.learners.empty());
    return all;
}

}  // namespace debrief
