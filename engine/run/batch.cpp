#include "engine/run/batch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <toml++/toml.h>

#include "engine/exercise/worst_treatment.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"
#include "engine/run/batch_rows.h"
#include "engine/run/headless.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/parallel.h"

namespace run {
namespace {

namespace fs = std::filesystem;

/// A text, or a list of texts.
std::vector<std::string> texts(io::Section& section, std::string_view key) {
    const toml::node* node = section.find(key);
    if (!node) {
        section.missing(key, std::string(key));
        return {};
    }
    std::vector<std::string> found;
    if (const auto one = node->value_exact<std::string>()) {
        found.push_back(*one);
    } else if (const toml::array* list = node->as_array();
               list && !list->empty() && list->is_homogeneous(toml::node_type::string)) {
        for (const toml::node& text : *list) found.push_back(*text.value<std::string>());
    } else {
        section.refuse(key, *node, "expected a text or a list of texts");
    }
    return found;
}

std::string toml_text(const toml::node& node) {
    // toml++ writes seventeen digits of a number.
    if (const auto* number = node.as_floating_point()) {
        const std::string text = io::number_text(number->get());
        return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
    }
    std::ostringstream text;
    text << toml::node_view<const toml::node>(node);
    return text.str();
}

/// The values that a key takes in turn.
using Choices = std::vector<std::pair<std::string, std::vector<std::string>>>;

void read_choices(const toml::node* node, io::Section& section, Choices& choices) {
    if (!node) return;
    const toml::table* table = node->as_table();
    if (!table) {
        section.refuse("set", *node, "expected a section [run.set] with \"KEY\" = VALUE or a list of values");
        return;
    }
    for (const auto& [key, value] : *table) {
        std::vector<std::string> values;
        if (const toml::array* list = value.as_array())
            for (const toml::node& one : *list) values.push_back(toml_text(one));
        else
            values.push_back(toml_text(value));
        if (values.empty())
            section.refuse(fmt::format("set.{}", key.str()), value,
                           "expected a value or a list of one or more");
        choices.emplace_back(std::string(key.str()), std::move(values));
    }
}

/// What a list asks for and who makes it, as one number: names, contents of scenarios and scripts, the
/// program.
std::string hash_of(const std::vector<BatchJob>& list, const BatchOptions& options) {
    geometry::Hash hash;
    const auto add = [&hash](const std::string& text) {
        hash.add(std::uint64_t{text.size()});
        hash.add(text.data(), text.size());
    };
    std::map<fs::path, std::string> texts;
    const auto content = [&texts](const fs::path& file) -> const std::string& {
        const auto [text, is_new] = texts.try_emplace(file);
        if (is_new) text->second = io::read_text(file, "file", "expected one that can be read");
        return text->second;
    };
    for (const BatchJob& job : list) {
        add(job.scenario.stem().string());
        add(content(job.scenario));
        add(job.commands.filename().string());
        add(content(job.commands));
        add(job.values_text());
        hash.add(std::uint64_t{job.images});
    }
    hash.add(options.origin.program_hash);
    return io::hash_text(hash.value());
}

/// What a job will do, as one number.
std::string identity(const BatchJob& job, const scenario::Scenario& scenario, const std::string& script,
                     const BatchOptions& options) {
    geometry::Hash hash;
    hash.add(scenario.content);
    // A file of vessels may change while the scenario that names it stays.
    if (!scenario.anatomy.empty() || scenario.places.contains("anatomy.tree"))
        hash.add(anatomy::hash_of(scenario::anatomy_of(scenario, options.cache)));
    hash.add(script.data(), script.size());
    hash.add(options.origin.program_hash);
    hash.add(std::uint64_t{job.images});
    return io::hash_text(hash.value());
}

/// The job as it is to be played, and its identity. Throws InputError.
struct Asked {
    scenario::Scenario scenario;
    script::CommandScript script;
    std::string identity;
};
Asked asked_for(const BatchJob& job, const BatchOptions& options) {
    Asked asked{scenario::load_scenario(job.scenario, options.devices, job.values),
                script::load_commands(job.commands),
                {}};
    asked.identity =
        identity(job, asked.scenario, io::read_text(job.commands, "script", "expected a script"), options);
    return asked;
}

std::vector<io::CsvCell> names_of(const BatchJob& job) {
    return {static_cast<double>(job.number), job.scenario.stem().string(), job.commands.filename().string(),
            job.values_text()};
}

/// The row of an earlier call where it is of this job as it is now asked for.
std::optional<BatchRow> still_of(const BatchJob& job, const fs::path& out, const BatchOptions& options,
                                 const std::map<int, BatchRow>& before) {
    const auto known = before.find(job.number);
    if (known == before.end()) return std::nullopt;
    if (!known->second.failed && !fs::exists(out / run_folder(job.number) / "score.json"))
        return std::nullopt;
    try {
        if (asked_for(job, options).identity != known->second.of) return std::nullopt;
    } catch (const std::exception&) {
        return std::nullopt;
    }
    BatchRow row = known->second;
    std::ranges::copy(names_of(job), row.cells.begin());
    return row;
}

BatchRow make_run(const BatchJob& job, const fs::path& out, const BatchOptions& options, bool& interrupted) {
    BatchRow row;
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    row.cells = names_of(job);
    const auto fail = [&row](std::string why) {
        row.cells.resize(4);
        row.cells.insert(row.cells.end(), batch_columns - 6, none);
        row.cells.emplace_back(std::string());
        row.cells.emplace_back(std::move(why));
        row.failed = true;
    };
    try {
        const Asked asked = asked_for(job, options);
        row.of = asked.identity;
        RunOptions run;
        run.images = job.images;
        run.origin = options.origin;
        run.cache = options.cache;
        run.interrupted = options.interrupted;
        const RunResult result =
            run_headless(asked.scenario, asked.script, out / run_folder(job.number), run);
        interrupted = result.interrupted;
        const exercise::Score& s = result.score;
        const auto errors = exercise::counts(s.handling_errors);
        const auto number_of = [&](exercise::HandlingError kind) {
            return static_cast<double>(errors[static_cast<std::size_t>(kind)]);
        };
        for (const double value :
             {static_cast<double>(s.completed), s.completion_time.value_or(none), s.beam_on_time, s.contrast,
              s.wire_travel, s.tip_to_target, s.peak_wall_force, static_cast<double>(s.wrong_entries()),
              static_cast<double>(s.handling_errors.size()), number_of(exercise::HandlingError::Dissection),
              number_of(exercise::HandlingError::Perforation)})
            row.cells.emplace_back(value);
        std::optional<exercise::WorstTreatment> treatment;
        if (s.treatment) treatment = exercise::worst_of(*s.treatment);
        for (const auto& [name, value] : exercise::columns_of(treatment)) row.cells.emplace_back(value);
        row.cells.emplace_back(static_cast<double>(s.frames));
        row.cells.emplace_back(io::hash_text(result.state_hash));
        row.cells.emplace_back(std::string());
    } catch (const std::exception& error) {
        fail(error.what());
    }
    return row;
}

/// Throws InputError where the batch would replace what it reads.
void require_no_input_of(const std::vector<BatchJob>& list, const fs::path& out, const fs::path& file) {
    std::set<fs::path> read;
    for (const BatchJob& job : list) read.insert({job.scenario, job.commands});
    std::vector<fs::path> inputs(read.begin(), read.end());
    for (const fs::path& input : inputs) {
        const fs::path folder = fs::absolute(input).lexically_normal().parent_path();
        const std::optional<long long> number = io::parse_integer(folder.filename().string());
        if (number && *number >= 1 && *number <= static_cast<long long>(list.size()) &&
            io::same_file(folder, out / run_folder(static_cast<int>(*number))))
            throw io::InputError("--out: {} would be replaced, and is read; expected another output folder",
                                 input.string());
    }
    if (!file.empty()) inputs.push_back(file);
    std::vector<io::Output> outputs;
    for (const char* name : {"batch.csv", "batch.json", "shard.json"})
        outputs.push_back({"--out", out / name});
    io::require_distinct(outputs, inputs);
}

}  // namespace

std::string BatchJob::values_text() const {
    std::string text;
    for (const scenario::Override& value : values)
        text += fmt::format("{}{}={}", text.empty() ? "" : " ", value.key, value.value);
    return text;
}

namespace {

/// The file of the script that a list names.
fs::path commands_of(const scenario::ExerciseFiles& exercise, const std::string& script,
                     const fs::path& beside, const BatchOptions& options) {
    if (script == "solution") {
        if (!exercise.solution.empty()) return exercise.solution;
        throw io::InputError("'{}' has no solution: expected {}.gw beside {}", exercise.name, exercise.name,
                             exercise.file.string());
    }
    const fs::path own = beside / script;
    io::require_no_device(own);
    if (fs::is_regular_file(own)) return own;
    try {
        const fs::path other = options.exercise(script, beside).solution;
        if (scenario::is_exercise_name(script) && !other.empty()) return other;
    } catch (const io::InputError&) {
        // What is accepted is told below.
    }
    throw io::InputError(
        "'{}': no such script; expected a file beside the list, 'solution', or the name of an exercise that "
        "has one",
        script);
}

}  // namespace

std::vector<BatchJob> load_batch(const fs::path& file, const BatchOptions& options) {
    const std::string text = io::read_text(file, "list of runs", "expected a .toml file");
    io::ParseContext reading{file.string(), {}, {}};
    std::vector<BatchJob> jobs;
    const toml::table root = reading.parse(text);
    io::Section top(reading, &root, "");
    top.schema();
    std::vector<io::Section> runs = top.sections("run");
    if (runs.empty()) top.missing("run", "[[run]] with scenario and commands");
    for (io::Section& run : runs) {
        BatchJob job;
        const std::vector<std::string> scenarios = texts(run, "scenario"), scripts = texts(run, "commands");
        run.flag("images", job.images);
        Choices choices;
        read_choices(run.find("set"), run, choices);
        if (const toml::node* seeds = run.find("seeds")) {
            const toml::array* list = seeds->as_array();
            std::vector<std::string> values;
            if (list && !list->empty() && list->is_homogeneous(toml::node_type::integer))
                for (const toml::node& seed : *list) values.push_back(toml_text(seed));
            else
                run.refuse("seeds", *seeds, "expected a list of whole numbers");
            for (const auto& [key, given] : choices)
                if (key == "seed")
                    run.refuse("seeds", *seeds, "expected either 'seeds' or 'seed' in [run.set]");
            choices.emplace_back("seed", std::move(values));
        }
        run.finish();
        for (const std::string& named : scenarios)
            for (const std::string& script : scripts) {
                try {
                    const scenario::ExerciseFiles exercise = options.exercise(named, file.parent_path());
                    job.scenario = exercise.file;
                    job.commands = commands_of(exercise, script, file.parent_path(), options);
                } catch (const io::InputError& error) {
                    reading.wrong.emplace_back(io::TextPlace{reading.file, 0, 0}, error.what());
                    continue;
                }
                std::size_t combinations = 1;
                for (const auto& [key, values] : choices)
                    combinations = std::min(combinations * values.size(), most_runs + 1);
                if (jobs.size() + combinations > most_runs) {
                    run.refuse_whole(fmt::format("the list has more than {} runs", most_runs));
                    break;
                }
                for (std::size_t k = 0; k < combinations; ++k) {
                    job.values.clear();
                    std::size_t rest = k;
                    for (const auto& [key, values] : choices) {
                        job.values.push_back({key, values[rest % values.size()]});
                        rest /= values.size();
                    }
                    job.number = static_cast<int>(jobs.size()) + 1;
                    jobs.push_back(job);
                }
            }
    }
    top.finish();
    reading.end();
    return jobs;
}

BatchResult run_batch(const std::vector<BatchJob>& list, const fs::path& out, const BatchOptions& asked) {
    std::vector<BatchJob> jobs = list;
    if (asked.shard) {
        if (static_cast<std::size_t>(asked.shard->count) > list.size())
            throw io::InputError("--shard: {} shards were asked for; expected at most {}, one a run",
                                 asked.shard->count, list.size());
        std::erase_if(jobs, [&](const BatchJob& job) { return !is_in(*asked.shard, job.number); });
    }
    require_no_input_of(list, out, asked.list);
    io::OwnFolder own(out);
    io::remove_leftovers(out);
    for (const char* name : {"batch.csv", "batch.json", "shard.json"}) io::require_writable(out / name);
    BatchOptions options = asked;
    if (options.cache.folder.empty()) options.cache.folder = anatomy::cache_beside(out / "run");
    const std::map<int, BatchRow> before = kept_rows(out / "batch.json");
    std::map<int, BatchRow> rows;  // of this list alone, whatever the folder has had
    BatchResult result;
    result.of = jobs.size();
    std::mutex mutex;
    std::atomic<bool> stopped = false;
    const auto for_each_job = [&](const auto& action) {
        geometry::for_each_index(static_cast<int>(jobs.size()), std::max(1, options.jobs), [&](int k) {
            if (!stopped && options.interrupted && options.interrupted()) stopped = true;
            if (!stopped) action(jobs[static_cast<std::size_t>(k)]);
        });
    };
    const auto count = [&](const BatchRow& row) {
        ++result.runs;
        result.failed += row.failed;
        if (options.progress) options.progress(result.runs, jobs.size(), result.failed);
    };
    const std::string list_hash = asked.shard ? hash_of(list, asked) : std::string();
    if (!before.empty())
        for_each_job([&](const BatchJob& job) {
            std::optional<BatchRow> row = still_of(job, out, options, before);
            if (!row) return;
            const std::lock_guard lock(mutex);
            // What has failed is tried again; until then its row says so.
            if (!row->failed) ++result.skipped, count(*row);
            rows[job.number] = *std::move(row);
        });
    result.interrupted = stopped;
    if (stopped) return result;  // the folder is as it was
    // A whole batch is no share. Rows before the share: should this end in between, those of another list are
    // gone from the one that is there.
    if (!asked.shard) fs::remove(out / "shard.json");
    write_rows(rows, out);
    if (asked.shard) write_share({list_hash, *asked.shard, list.size()}, out);
    const std::map<int, BatchRow> kept = rows;
    auto written = std::chrono::steady_clock::now();
    for_each_job([&](const BatchJob& job) {
        const auto known = kept.find(job.number);
        if (known != kept.end() && !known->second.failed) return;
        bool interrupted = false;
        BatchRow row = make_run(job, out, options, interrupted);
        const std::lock_guard lock(mutex);
        if (interrupted) stopped = true;
        if (interrupted) return;
        count(row);
        rows[job.number] = std::move(row);
        const auto now = std::chrono::steady_clock::now();
        if (now - written < std::chrono::seconds(1)) return;
        written = now;
        write_rows(rows, out);
    });
    result.interrupted = stopped && result.runs < jobs.size();
    write_rows(rows, out);
    return result;
}

}  // namespace run
