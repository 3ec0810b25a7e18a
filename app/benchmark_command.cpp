/// `seldinger benchmark`: what skilled attempts come to, as the measure of all others.

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <string>
#include <variant>

#include "app/command.h"
#include "app/played_attempt.h"
#include "app/progress_bar.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/grade.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/run/headless.h"
#include "engine/script/recording.h"

namespace app {
namespace {

struct BenchmarkArguments {
    std::string folder, out, cache, by, keep;
    std::vector<std::string> exercises, folders;
    int played = 0;
    std::uint64_t seed = 1;
};

/// The attempts at one exercise that count.
struct Attempts {
    scenario::Scenario scenario;
    std::vector<exercise::Score> reached;
    int missed = 0;
};

std::optional<std::vector<Attempts>> play_solutions(const BenchmarkArguments& arguments) {
    const room::Speeds speeds = key_speeds();
    std::vector<std::string> names = arguments.exercises;
    if (names.empty())
        for (const LoadedExercise& one : loaded(exercise_folders(arguments.folders).all()))
            if (!one.files.solution.empty() && !one.scenario.lesson.guided()) names.push_back(one.files.name);
    anatomy::ModelCache cache;
    cache.folder = usual_cache(arguments.cache);
    ProgressBar bar;
    std::vector<Attempts> all;
    for (const std::string& name : names) {
        const scenario::ExerciseFiles files = exercise_named({name, arguments.folders});
        const auto solution = script_for(files, {});
        if (!solution) throw io::InputError("{}: expected a solution beside it, found none", name);
        Attempts attempts{load_exercise(files.file), {}, 0};
        for (int k = 0; k < arguments.played; ++k) {
            bar.show((static_cast<double>(all.size()) + static_cast<double>(k) / arguments.played) /
                         static_cast<double>(names.size()),
                     fmt::format("{}, attempt {} of {}", attempts.scenario.name, k + 1, arguments.played));
            const std::filesystem::path keep =
                arguments.keep.empty() ? std::filesystem::path()
                                       : std::filesystem::path(arguments.keep) /
                                             fmt::format("{}-{:03}.gw", attempts.scenario.name, k + 1);
            if (std::error_code ignored; !keep.empty() && std::filesystem::exists(keep, ignored))
                throw io::InputError("--keep: {} is there already: expected a folder without it",
                                     keep.string());
            const auto score = played_attempt(attempts.scenario, *solution, speeds,
                                              arguments.seed + static_cast<std::uint64_t>(k), cache, keep);
            if (!score) return std::nullopt;
            if (score->completed)
                attempts.reached.push_back(*score);
            else
                ++attempts.missed;
        }
        all.push_back(std::move(attempts));
    }
    return all;
}

/// Whether a teacher changed what the learner saw or met: to open the teacher's window alone changes nothing.
bool teacher_interfered(const script::CommandScript& recording) {
    return std::ranges::any_of(recording.commands, [](const script::TimedCommand& timed) {
        const auto* act = std::get_if<script::TeacherAct>(&timed.command);
        return (act && act->thing != script::TeacherAct::Thing::Window) ||
               std::holds_alternative<script::Complicate>(timed.command);
    });
}

std::optional<std::vector<Attempts>> read_recordings(const BenchmarkArguments& arguments) {
    std::vector<Attempts> all;
    const std::vector<std::filesystem::path> files = script::recordings_of(arguments.folder);
    ProgressBar bar;
    for (std::size_t k = 0; k < files.size(); ++k) {
        bar.show(static_cast<double>(k) / static_cast<double>(files.size()),
                 fmt::format("recording {} of {}", k + 1, files.size()));
        const script::CommandScript recording = script::load_commands(files[k]);
        if (recording.origin && recording.origin->free_practice) {
            tell("note: {}: free practice, and no attempt\n", files[k].string());
            continue;
        }
        if (recording.origin && !recording.origin->patient.empty()) {
            tell("note: {}: of patient {}; benchmarks are of the first\n", files[k].string(),
                 recording.origin->patient);
            continue;
        }
        if (teacher_interfered(recording)) {
            tell("note: {}: a teacher helped or hindered; it is in no benchmark\n", files[k].string());
            continue;
        }
        const scenario::Scenario scenario = scenario_of(recording, {{}, arguments.folders});
        run::RunOptions options;
        options.images = false;
        options.same_origin = true;
        options.cache.folder = usual_cache(arguments.cache);
        options.interrupted = stop_requested;
        run::RunResult result = run::run_headless(scenario, recording, options);
        if (result.interrupted) return std::nullopt;
        if (!result.differences.empty())
            throw io::InputError("{}: it does not lead to the states it states: {}", files[k].string(),
                                 result.differences.front());
        auto known = std::find_if(all.begin(), all.end(), [&](const Attempts& attempts) {
            return attempts.scenario.content == scenario.content && attempts.scenario.name == scenario.name;
        });
        if (known == all.end()) known = all.insert(all.end(), Attempts{scenario, {}, 0});
        result.earlier.push_back(result.score);
        for (const exercise::Score& score : result.earlier)
            if (score.completed)
                known->reached.push_back(score);
            else
                ++known->missed;
    }
    return all;
}

/// Where it is looked for before what ships.
std::filesystem::path usual_file() {
    const std::filesystem::path folder = user_folder("XDG_DATA_HOME", ".local/share");
    if (folder.empty())
        throw io::InputError(
            "expected HOME or XDG_DATA_HOME to name a folder, found neither; --out names a file");
    return folder / scenario::benchmark_file;
}

int benchmark(const BenchmarkArguments& arguments) {
    if (arguments.folder.empty() == (arguments.played == 0))
        throw BadArgument("expected either a folder of recordings or --played NUMBER, found {}",
                          arguments.folder.empty() ? "neither" : "both");
    if (arguments.played == 0 && arguments.by.empty())
        throw BadArgument(
            "--by is missing: who made the attempts, such as --by \"Dr N. and Dr M., vascular surgeons\"");
    const std::filesystem::path out =
        arguments.out.empty() ? usual_file() : std::filesystem::path(arguments.out);
    std::error_code ignored;
    scenario::Benchmarks all;
    if (std::filesystem::exists(out, ignored)) all = scenario::load_benchmarks(out);
    if (arguments.out.empty()) io::make_folder(out.parent_path());
    io::require_writable(out);
    if (!arguments.keep.empty()) io::make_folder(arguments.keep);
    const auto made = arguments.played > 0 ? play_solutions(arguments) : read_recordings(arguments);
    if (!made) return interrupted;
    int tables = 0;
    for (const Attempts& attempts : *made) {
        const std::string& name = attempts.scenario.name;
        if (attempts.missed > 0)
            tell("note: {}: {} attempts did not reach the target and do not count\n", name, attempts.missed);
        if (attempts.reached.empty()) continue;
        const scenario::Benchmark of = exercise::benchmark_of(
            attempts.reached, arguments.by.empty() ? by_a_program : arguments.by, attempts.scenario.content);
        print("{}: {} attempts{}\n", name, of.attempts,
              all.contains(name) ? ", in place of earlier ones" : "");
        for (const exercise::GradeLine& line : exercise::grade({}, of).lines)
            if (line.mean) print("  {:<34} {}\n", line.measure->name, exercise::skilled_text(line));
        double least = 100, sum = 0;
        for (const exercise::Score& score : attempts.reached) {
            const double points = exercise::grade(score, of).points;
            least = std::min(least, points);
            sum += points;
        }
        print("  {:<34} {:.1f} on average, {:.1f} at least\n", "their own points", sum / of.attempts, least);
        all[name] = of;
        ++tables;
    }
    if (tables == 0) throw io::InputError("no attempt reached its target: {} stays as it is", out.string());
    io::write_whole(out, scenario::to_toml(all));
    print("{}: {} exercises\n", out.string(), all.size());
    return done;
}

}  // namespace

Command add_benchmark(CLI::App& parser) {
    const auto arguments = std::make_shared<BenchmarkArguments>();
    CLI::App* command =
        parser.add_subcommand("benchmark",
                              "What skilled attempts come to: the measure that all others are graded by\n\n"
                              "Examples:\n"
                              "  seldinger benchmark recordings --by \"Dr N., vascular surgeon\"\n"
                              "  seldinger benchmark --played 5 --of renal --out benchmark.toml");
    command
        ->add_option("folder", arguments->folder,
                     "Folder with recordings (.gw) of skilled attempts, also in folders below")
        ->type_name("FOLDER");
    command->add_option("--by", arguments->by, "Who made them, in words: it is shown with every grade")
        ->type_name("WORDS");
    command
        ->add_option(
            "--out", arguments->out,
            "The file; what it says of other exercises stays. Else benchmark.toml in the user's data, "
            "which goes before what ships")
        ->type_name("FILE");
    command
        ->add_option(
            "--played", arguments->played,
            "So many attempts at each exercise by a program that plays its solution at the speed of keys")
        ->check(whole_number(1, 100));
    command->add_option("--of", arguments->exercises, "With --played: only this exercise; again for more")
        ->type_name("SCENARIO")
        ->needs("--played");
    add_exercises(command, arguments->folders);
    command->add_option("--seed", arguments->seed, "With --played: of the first attempt")->needs("--played");
    command->add_option("--keep", arguments->keep, "With --played: folder for the recordings")
        ->type_name("FOLDER")
        ->needs("--played");
    add_cache_folder(command, arguments->cache);
    return {command, [arguments] { return benchmark(*arguments); }};
}

}  // namespace app
