#include "engine/debrief/course.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <fmt/format.h>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>
#include <variant>

#include "engine/exercise/grade.h"
#include "engine/io/csv.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"
#include "engine/run/headless.h"
#include "engine/script/command.h"
#include "engine/script/recording.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/parallel.h"

template <class T>
struct nlohmann::adl_serializer<std::optional<T>> {
    static void to_json(json& j, const std::optional<T>& value) { j = value ? json(*value) : json(); }
    static void from_json(const json& j, std::optional<T>& value) {
        if (!j.is_null()) value = j.get<T>();
    }
};

namespace debrief {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CourseTreatment, residual, lumen, gradient, covered, missed_proximal,
                                   missed_distal, proximal_off, distal_off, balloon_to_artery, inflations,
                                   bursts, dissections, dissections_left, ruptures)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CourseRow, exercise, level, problem, reached, points, time, beam, contrast,
                                   travel, force, wrong_entries, errors, title, air_kerma, area_product,
                                   angiograms, costs, blind, teacher, treatment)

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
               std::ranges::find(learners, name->get()) == learners.end();
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
    const auto found = std::ranges::find(exercises, exercise, &PlannedExercise::name);
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

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// With the patient, where it is not the first.
std::string title_of(const scenario::Scenario& scenario) {
    return scenario.title + (scenario.patient.empty() ? "" : ", " + scenario.patient_text());
}

CourseRow row_of(const exercise::Score& score, const scenario::Scenario& scenario) {
    CourseRow row;
    row.exercise = scenario.name;
    row.level = scenario.lesson.level;
    row.reached = score.completed;
    row.title = title_of(scenario);
    if (scenario.lesson.benchmark.given()) {
        const exercise::Grade grade = exercise::grade(score, scenario.lesson.benchmark);
        row.points = grade.points;
        for (const exercise::GradeLine& line : grade.lines) {
            row.costs.push_back(line.cost);
            row.blind = row.blind || line.unseen;
        }
    }
    row.time = score.completed_after;
    row.beam = score.beam_on_time;
    row.contrast = score.contrast;
    row.travel = score.wire_travel;
    row.force = score.peak_wall_force;
    row.wrong_entries = score.wrong_entries();
    row.errors = exercise::counts(score.handling_errors);
    row.air_kerma = score.air_kerma;
    row.area_product = score.area_product;
    row.angiograms = score.angiograms;
    row.teacher = exercise::text_of(score.teacher);
    if (score.treatment) row.treatment = CourseTreatment{exercise::worst_of(*score.treatment)};
    return row;
}

/// Where the figures of a recording are kept; empty without a cache.
fs::path kept_at(const std::string& text, const scenario::Scenario& scenario, const CourseOptions& options) {
    if (options.cache.folder.empty()) return {};
    geometry::Hash hash;
    hash.add(text.data(), text.size());
    hash.add(scenario.content);
    // A file of vessels may change while the scenario that names it stays.
    if (!scenario.anatomy.empty() || scenario.places.contains("anatomy.tree"))
        hash.add(anatomy::hash_of(scenario::anatomy_of(scenario, options.cache)));
    for (const scenario::BenchmarkFigure& figure : scenario::benchmark_figures())
        for (const double value : (scenario.lesson.benchmark.*figure.sample).values) hash.add(value);
    hash.add(options.program_hash.data(), options.program_hash.size());
    return options.cache.folder / "scores" / (io::hash_text(hash.value()) + ".json");
}

/// The attempts of one recording, without their number.
std::vector<CourseRow> rows_of(const fs::path& file, const CourseOptions& options) {
    CourseRow row;
    std::string learner, patient;
    std::vector<CourseRow> rows;
    try {
        const std::string text = io::read_text(file, "recording", "expected a recording (.gw)");
        const script::CommandScript recording = script::parse_commands(text, file.string());
        if (!recording.origin || recording.origin->scenario.empty())
            throw io::InputError("a script, and no recording: it does not say which exercise it is of");
        if (recording.origin->free_practice)
            throw io::InputError("free practice, and no attempt: seconds may have been taken back");
        learner = recording.origin->learner;
        row.exercise = recording.origin->scenario;
        const scenario::Scenario scenario = options.scenario(recording);
        row.level = scenario.lesson.level;
        row.title = title_of(scenario);
        patient = scenario.patient;
        if (const std::string why = options.distrust ? options.distrust(text) : ""; !why.empty())
            throw io::InputError(why);
        const fs::path kept = kept_at(text, scenario, options);
        std::error_code ignored;
        if (!kept.empty() && fs::exists(kept, ignored)) {
            try {
                const std::string figures =
                    io::read_text(kept, "score", "expected a file that this program wrote");
                io::check_json_depth(figures, kept.string());
                const Json json = Json::parse(figures, nullptr, false);
                for (const Json& one : json) {
                    rows.push_back(one.get<CourseRow>());
                    if (!rows.back().costs.empty() && rows.back().costs.size() != exercise::measures().size())
                        throw io::InputError("figures of another version");
                }
            } catch (const std::exception&) {
                rows.clear();  // computed again
            }
        }
        if (rows.empty()) {
            run::RunOptions played;
            played.images = false;
            played.same_origin = true;
            played.cache = options.cache;
            played.interrupted = options.interrupted;
            const run::RunResult result = run::run_headless(scenario, recording, played);
            if (result.interrupted) return {};
            for (const exercise::Score& score : result.earlier) rows.push_back(row_of(score, scenario));
            rows.push_back(row_of(result.score, scenario));
            if (!result.differences.empty()) {
                rows.assign(1, row);
                rows[0].problem =
                    "it was changed after it was recorded, or made by another version of the program: it "
                    "does not lead to the states it states (" +
                    result.differences.front() + ")";
            }
            if (!kept.empty()) {
                Json json = Json::array();
                for (const CourseRow& one : rows) json.push_back(one);
                io::make_private_folder(options.cache.folder);
                try {
                    io::make_folder(kept.parent_path());
                    io::write_whole(kept, json.dump(-1, ' ', false, Json::error_handler_t::replace));
                } catch (const io::InputError&) {
                    // It is computed again the next time.
                }
            }
        }
        if (scenario.lesson.guided()) {
            // Beginning anew is one of its steps.
            rows.erase(rows.begin(), rows.end() - 1);
            rows[0].steps = {recording.origin->steps_done, static_cast<int>(scenario.lesson.steps.size())};
        }
    } catch (const std::exception& error) {
        row.problem = error.what();
        rows.assign(1, row);
    }
    std::optional<Day> day;
    try {
        day = day_of(script::time_of(file));
    } catch (const fs::filesystem_error&) {
        // It has gone meanwhile: its problem says so.
    }
    for (CourseRow& one : rows) {
        one.file = file.string();
        one.learner = learner;
        one.patient = patient;
        one.day = day;
    }
    return rows;
}

}  // namespace

int CourseRow::all_errors() const {
    int sum = 0;
    for (const int count : errors) sum += count;
    return sum;
}

std::optional<std::vector<CourseRow>> course_of(std::span<const fs::path> files,
                                                const CourseOptions& options) {
    std::vector<std::vector<CourseRow>> rows(files.size());
    if (!options.cache.folder.empty()) io::remove_leftovers(options.cache.folder / "scores");
    std::mutex mutex;
    std::size_t done = 0;
    std::atomic<bool> stopped = false;
    geometry::for_each_index(static_cast<int>(files.size()), std::max(1, options.jobs), [&](int k) {
        if (stopped) return;
        rows[k] = rows_of(files[k], options);
        const std::lock_guard lock(mutex);
        ++done;
        if (options.progress) options.progress(done, files.size());
        if (options.interrupted && options.interrupted()) stopped = true;
    });
    if (stopped) return std::nullopt;
    std::vector<CourseRow> all;
    std::map<std::pair<std::string, std::string>, int> attempts;
    for (std::vector<CourseRow>& of_file : rows)
        for (CourseRow& row : of_file) {
            if (row.problem.empty()) row.attempt = ++attempts[{row.learner, row.exercise}];
            all.push_back(std::move(row));
        }
    return all;
}

fs::path debriefing_page(const fs::path& recording, const fs::path& folder, const fs::path& out) {
    std::error_code ignored;
    // course.html is the course's own.
    const char* ending = recording.stem() == "course" ? ".gw.html" : ".html";
    const fs::path beside = fs::path(recording).replace_extension(ending);
    if (fs::is_regular_file(beside, ignored)) return beside;
    return (out / recording.lexically_relative(folder)).replace_extension(ending);
}

std::string link_to(const fs::path& file, const fs::path& folder) {
    std::string link;
    for (const char c : fs::absolute(file)
                            .lexically_normal()
                            .lexically_relative(fs::absolute(folder).lexically_normal())
                            .generic_string()) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           std::string_view("-._~/").find(c) != std::string_view::npos;
        link += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return link;
}

namespace {

/// What a column has of an attempt: NaN where there is nothing.
using Cell = std::variant<std::string, double, bool>;

std::vector<std::pair<std::string, Cell>> columns_of(const CourseRow& row, const CoursePlan& plan) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const bool counts = row.problem.empty();
    const auto figure = [counts](double value) { return counts ? value : none; };
    const auto flag = [counts, none](bool value) { return counts ? Cell(value) : Cell(none); };
    std::vector<std::pair<std::string, Cell>> columns = {{"learner", row.learner},
                                                         {"exercise", row.exercise},
                                                         {"level", double(row.level)},
                                                         {"attempt", figure(row.attempt)},
                                                         {"file", row.file},
                                                         {"reached", flag(row.reached)},
                                                         {"points", row.points.value_or(none)},
                                                         {"time_s", row.time.value_or(none)},
                                                         {"beam_s", figure(row.beam)},
                                                         {"contrast_ml", figure(row.contrast)},
                                                         {"travel_mm", figure(row.travel)},
                                                         {"peak_force_N", figure(row.force)},
                                                         {"wrong_entries", figure(row.wrong_entries)},
                                                         {"errors", figure(row.all_errors())}};
    for (std::size_t kind = 0; kind < row.errors.size(); ++kind)
        columns.emplace_back(exercise::handling_error_ids[kind], figure(row.errors[kind]));
    const PlannedExercise* asked = plan.find(row.exercise);
    const double pass = asked ? asked->pass : plan.pass;
    columns.insert(columns.end(), {{"problem", row.problem},
                                   {"title", row.title},
                                   {"day", row.day ? day_text(*row.day) : std::string()},
                                   {"air_kerma_mGy", row.air_kerma.value_or(none)},
                                   {"kerma_area_product_Gy_cm2", row.area_product.value_or(none)},
                                   {"angiograms", figure(row.angiograms)},
                                   {"pass_mark", pass},
                                   {"passed", flag(row.passes(pass))},
                                   {"debriefing", row.debriefing},
                                   {"steps_done", row.steps ? row.steps->first : none},
                                   {"steps", row.steps ? row.steps->second : none},
                                   {"patient", row.patient},
                                   {"teacher", row.teacher}});
    for (const auto& [name, value] : exercise::columns_of(row.treatment)) columns.emplace_back(name, value);
    return columns;
}

}  // namespace

std::string course_csv(std::span<const CourseRow> rows, const CoursePlan& plan) {
    std::string text;
    for (const auto& [name, none] : columns_of({}, plan)) text += (text.empty() ? "" : ",") + name;
    text += "\n";
    for (const CourseRow& row : rows) {
        std::vector<io::CsvCell> cells;
        for (const auto& [name, cell] : columns_of(row, plan))
            std::visit([&cells](const auto& value) { cells.emplace_back(value); }, cell);
        io::append_row(text, cells);
    }
    return io::as_utf8(text);
}

std::string course_json(std::span<const CourseRow> rows, const CoursePlan& plan) {
    nlohmann::ordered_json attempts = nlohmann::ordered_json::array();
    for (const CourseRow& row : rows) {
        nlohmann::ordered_json attempt;
        for (const auto& [name, cell] : columns_of(row, plan))
            std::visit([&to = attempt[name]](const auto& value) { to = value; }, cell);  // NaN is null
        attempts.push_back(std::move(attempt));
    }
    const nlohmann::ordered_json course = {{"schema", 1}, {"attempts", attempts}};
    return course.dump(2, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace debrief
