#include "engine/debrief/course.h"

#include <algorithm>
#include <atomic>
#include <fmt/format.h>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>

#include "engine/debrief/page_text.h"
#include "engine/exercise/grade.h"
#include "engine/io/csv.h"
#include "engine/io/depth.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/headless.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/parallel.h"

template <>
struct nlohmann::adl_serializer<std::optional<double>> {
    static void to_json(json& j, const std::optional<double>& value) { j = value ? json(*value) : json(); }
    static void from_json(const json& j, std::optional<double>& value) {
        if (!j.is_null()) value = j.get<double>();
    }
};

namespace debrief {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CourseRow, exercise, level, problem, reached, points, time, beam, contrast,
                                   travel, force, wrong_entries, errors)

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* nobody = "(no name)";

CourseRow row_of(const exercise::Score& score, const scenario::Scenario& scenario) {
    CourseRow row;
    row.exercise = scenario.name;
    row.level = scenario.lesson.level;
    row.reached = score.completed;
    if (scenario.lesson.benchmark.given())
        row.points = exercise::grade(score, scenario.lesson.benchmark).points;
    row.time = score.completed_after;
    row.beam = score.beam_on_time;
    row.contrast = score.contrast;
    row.travel = score.wire_travel;
    row.force = score.peak_wall_force;
    row.wrong_entries = score.wrong_entries();
    row.errors = exercise::counts(score.mishaps);
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
    std::string learner;
    std::vector<CourseRow> rows;
    try {
        const std::string text = io::read_text(file, "recording", "a recording (.gw) is accepted");
        const script::CommandScript recording = script::parse_commands(text, file.string());
        if (!recording.origin || recording.origin->scenario.empty())
            throw io::InputError("a script, and no recording: it does not say which exercise it is of");
        if (recording.origin->free_practice)
            throw io::InputError("free practice, and no attempt: seconds may have been taken back");
        learner = recording.origin->learner;
        row.exercise = recording.origin->scenario;
        const scenario::Scenario scenario = options.scenario(recording);
        row.level = scenario.lesson.level;
        const fs::path kept = kept_at(text, scenario, options);
        std::error_code ignored;
        if (!kept.empty() && fs::exists(kept, ignored)) {
            try {
                const std::string figures = io::read_text(kept, "score", "its own is accepted");
                io::check_json_depth(figures, kept.string());
                const Json json = Json::parse(figures, nullptr, false);
                for (const Json& one : json) rows.push_back(one.get<CourseRow>());
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
                rows[0].problem = "it does not lead to the states it states: " + result.differences.front();
            }
            if (!kept.empty()) {
                Json json = Json::array();
                for (const CourseRow& one : rows) json.push_back(one);
                fs::create_directories(kept.parent_path(), ignored);
                try {
                    io::write_whole(kept, json.dump(-1, ' ', false, Json::error_handler_t::replace));
                } catch (const io::InputError&) {
                    // It is computed again the next time.
                }
            }
        }
    } catch (const std::exception& error) {
        row.problem = error.what();
        rows.assign(1, row);
    }
    for (CourseRow& one : rows) {
        one.file = file.string();
        one.learner = learner;
    }
    return rows;
}

std::string number(const std::optional<double>& value, int digits) {
    return value ? fmt::format("{:.{}f}", *value, digits) : std::string("&ndash;");
}

/// What one learner has made of one exercise.
struct Cell {
    int attempts = 0, reached = 0;
    std::optional<double> best, last, best_time;  // points, points, [s]
    void add(const CourseRow& row) {
        ++attempts;
        reached += row.reached;
        last = row.points;
        if (row.points) best = std::max(best.value_or(0), *row.points);
        if (row.time) best_time = std::min(best_time.value_or(*row.time), *row.time);
    }
};

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

std::string course_csv(std::span<const CourseRow> rows) {
    std::string text =
        "learner,exercise,level,attempt,file,reached,points,time_s,beam_s,contrast_ml,travel_mm,peak_force_N,"
        "wrong_entries,errors";
    for (const char* id : exercise::mishap_ids) text += std::string(",") + id;
    text += ",problem\n";
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    for (const CourseRow& row : rows) {
        const bool counts = row.problem.empty();
        const auto figure = [counts](double value) { return counts ? value : none; };
        std::vector<io::CsvCell> cells = {row.learner,
                                          row.exercise,
                                          row.level,
                                          figure(row.attempt),
                                          row.file,
                                          figure(row.reached),
                                          row.points.value_or(none),
                                          row.time.value_or(none),
                                          figure(row.beam),
                                          figure(row.contrast),
                                          figure(row.travel),
                                          figure(row.force),
                                          figure(row.wrong_entries),
                                          figure(row.all_errors())};
        for (const int count : row.errors) cells.push_back(figure(count));
        cells.push_back(row.problem);
        io::append_row(text, cells);
    }
    return io::as_utf8(text);
}

std::string course_page(std::span<const CourseRow> rows, const std::string& title) {
    std::map<std::pair<int, std::string>, int> exercises;  // by level and name: attempts
    std::map<std::string, std::map<std::string, Cell>> cells;
    std::map<std::string, std::array<int, exercise::mishap_kinds>> errors;
    std::map<std::string, int> attempts, wrong;
    std::size_t bad = 0;
    for (const CourseRow& row : rows) {
        if (!row.problem.empty()) {
            ++bad;
            continue;
        }
        const std::string learner = row.learner.empty() ? nobody : row.learner;
        ++exercises[{row.level, row.exercise}];
        cells[learner][row.exercise].add(row);
        auto& kinds = errors[learner];
        for (std::size_t k = 0; k < kinds.size(); ++k) kinds[k] += row.errors[k];
        ++attempts[learner];
        wrong[learner] += row.wrong_entries;
    }
    std::string text = fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<meta name=\"viewport\" content=\"width=device-width\">"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
        "'unsafe-inline'\">"
        "<title>Course: {0}</title><style>{1}.wide{{overflow-x:auto}}td "
        "small{{color:var(--soft);display:block}}"
        "</style></head><body>\n<header><h1>Course: {0}</h1><p class=\"about\">{2} learners, {3} exercises, "
        "{4} "
        "attempts{5}</p></header>",
        io::html_escaped(title), page_style, cells.size(), exercises.size(), rows.size() - bad,
        bad > 0 ? fmt::format(", {} that do not count", bad) : "");
    text +=
        "<h2>Learners and exercises</h2><p class=\"about\">Best points, below them the last attempt's, how "
        "many of "
        "the attempts reached the target, and the shortest time.</p><div "
        "class=\"wide\"><table><thead><tr><th></th>";
    for (const auto& [key, count] : exercises)
        text += fmt::format("<th>{}{}</th>", io::html_escaped(key.second),
                            key.first > 0 ? fmt::format("<br><small>level {}</small>", key.first) : "");
    text += "</tr></thead><tbody>";
    for (const auto& [learner, of] : cells) {
        text += fmt::format("<tr><td>{}</td>", io::html_escaped(learner));
        for (const auto& [key, count] : exercises) {
            const auto cell = of.find(key.second);
            if (cell == of.end()) {
                text += "<td>&ndash;</td>";
                continue;
            }
            const Cell& c = cell->second;
            text += fmt::format("<td class=\"{}\">{}<small>last {}, {} of {}{}</small></td>",
                                c.reached == 0             ? "worse"
                                : c.best.value_or(0) >= 80 ? "better"
                                                           : "",
                                number(c.best, 0), number(c.last, 0), c.reached, c.attempts,
                                c.best_time ? fmt::format(", {:.1f} s", *c.best_time) : "");
        }
        text += "</tr>";
    }
    text +=
        "</tbody></table></div><h2>Errors of handling per attempt</h2><div "
        "class=\"wide\"><table><thead><tr><th></th>"
        "<th>attempts</th>";
    for (std::string what : exercise::mishap_ids) {
        std::replace(what.begin(), what.end(), '_', ' ');
        text += fmt::format("<th>{}</th>", what);
    }
    text += "<th>wrong branches</th></tr></thead><tbody>";
    for (const auto& [learner, kinds] : errors) {
        const double of = attempts[learner];
        text += fmt::format("<tr><td>{}</td><td>{}</td>", io::html_escaped(learner), attempts[learner]);
        for (const int count : kinds)
            text += fmt::format("<td{}>{:.2g}</td>", count / of >= 1 ? " class=\"worse\"" : "", count / of);
        text += fmt::format("<td>{:.2g}</td></tr>", wrong[learner] / of);
    }
    text += "</tbody></table></div>";
    if (bad > 0) {
        text += "<h2>Files that do not count</h2><ul>";
        for (const CourseRow& row : rows)
            if (!row.problem.empty())
                text +=
                    fmt::format("<li>{}: {}</li>", io::html_escaped(row.file), io::html_escaped(row.problem));
        text += "</ul>";
    }
    return io::as_utf8(text) + "</body></html>\n";
}

}  // namespace debrief
