#include "engine/debrief/course_plan.h"

#include <algorithm>
#include <ctime>
#include <fmt/format.h>
#include <toml++/toml.h>

#include "engine/exercise/grade.h"
#include "engine/io/error.h"
#include "engine/io/toml_section.h"
#include "engine/script/command.h"

namespace debrief {
namespace {

constexpr io::Range passes{0, 100};

PlannedExercise planned(const scenario::Scenario& scenario, double pass) {
    return {scenario.name, scenario.title, scenario.lesson.level, pass};
}

void read_due(io::Section& section, std::optional<Day>& due) {
    const toml::node* node = section.find("due");
    if (!node) return;
    if (const toml::value<toml::date>* date = node->as_date()) {
        const std::chrono::year_month_day day{std::chrono::year(date->get().year),
                                              std::chrono::month(date->get().month),
                                              std::chrono::day(date->get().day)};
        if (day.ok()) {
            due = Day(day);
            return;
        }
    }
    section.refuse("due", *node, "expected a date without quotes, as 2026-12-24");
}

PlannedExercise read_exercise(io::Section section, const CoursePlan& plan, const FindScenario& find) {
    PlannedExercise read;
    read.pass = plan.pass;
    if (!section.find("name")) {
        section.missing("name", "name = \"EXERCISE\"");
    } else if (std::string name; section.word("name", name)) {
        try {
            if (plan.find(name))
                throw io::InputError("'{}' stands above already; expected each exercise once", name);
            read = planned(find(name), plan.pass);
        } catch (const io::InputError& error) {
            section.refuse("name", *section.find("name"), error.what());
        }
        read.name = name;
    }
    section.number("pass", read.pass, passes);
    read_due(section, read.due);
    section.finish();
    return read;
}

void read_learners(io::Section& section, std::vector<std::string>& learners) {
    const toml::node* node = section.find("learners");
    if (!node) return;
    const toml::array* array = node->as_array();
    bool good = array != nullptr;
    for (std::size_t k = 0; good && k < array->size(); ++k) {
        const toml::value<std::string>* name = (*array)[k].as_string();
        good = name && script::is_learner(name->get()) &&
               std::find(learners.begin(), learners.end(), name->get()) == learners.end();
        if (good) learners.push_back(name->get());
    }
    if (!good)
        section.refuse("learners", *node,
                       fmt::format("expected a list of names in quotes, each once, of at most {} bytes, as "
                                   "recordings state them",
                                   script::longest_learner));
}

}  // namespace

std::string day_text(Day day) {
    const std::chrono::year_month_day date(day);
    return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()),
                       static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
}

Day day_of(std::chrono::system_clock::time_point time) {
    const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
    std::tm local{};
    ::localtime_r(&seconds, &local);
    return Day(std::chrono::year(local.tm_year + 1900) / (local.tm_mon + 1) / local.tm_mday);
}

const PlannedExercise* CoursePlan::find(const std::string& exercise) const {
    const auto found = std::find_if(exercises.begin(), exercises.end(),
                                    [&](const PlannedExercise& one) { return one.name == exercise; });
    return found == exercises.end() ? nullptr : &*found;
}

CoursePlan usual_plan(std::span<const scenario::Scenario> curriculum) {
    CoursePlan plan;
    plan.pass = exercise::pass_mark;
    for (const scenario::Scenario& scenario : curriculum)
        if (scenario.lesson.level > 0) plan.exercises.push_back(planned(scenario, plan.pass));
    return plan;
}

CoursePlan parse_plan(const std::string& text, const std::string& file, const FindScenario& find,
                      const CoursePlan& usual) {
    io::ParseContext reading{file, {}, {}};
    const toml::table root = reading.parse(text);
    io::Section top(reading, &root, "");
    CoursePlan plan;
    plan.file = file;
    plan.pass = usual.pass;
    top.schema();
    top.word("title", plan.title);
    top.number("pass", plan.pass, passes);
    top.whole("idle_days", plan.idle_days, {1, 3660});
    read_learners(top, plan.learners);
    for (io::Section& section : top.sections("exercise"))
        plan.exercises.push_back(read_exercise(std::move(section), plan, find));
    top.finish();
    reading.end();
    plan.lists_exercises = !plan.exercises.empty();
    if (!plan.lists_exercises) {
        plan.exercises = usual.exercises;
        for (PlannedExercise& exercise : plan.exercises) exercise.pass = plan.pass;
    }
    return plan;
}

}  // namespace debrief
