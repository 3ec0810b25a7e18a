/// `seldinger author`: a solution made of a recording, what it forgives, and the exercise's picture.

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/played_attempt.h"
#include "engine/author/check.h"
#include "engine/author/solution.h"
#include "engine/exercise/grade.h"
#include "engine/io/files.h"
#include "engine/run/headless.h"

namespace app {
namespace {

struct AuthorArguments {
    ScenarioChoice scenario;
    std::string from, cache;
    double off = 100 * author::usual_off;  // [%]
    bool replace = false;
    int jobs = 2;
};

/// Everything that the command finds out.
struct Found {
    author::Solution solution;
    std::vector<author::Attempt> attempts;
    double widest = 0;
    std::vector<double> clumsy;
};

/// The scenario's files as they will be.
scenario::ExerciseFiles outputs_of(scenario::ExerciseFiles files) {
    const std::filesystem::path folder = files.file.parent_path();
    if (files.solution.empty()) files.solution = folder / (files.name + ".gw");
    if (files.picture.empty()) files.picture = folder / (files.name + ".png");
    return files;
}

/// Throws InputError where something would be replaced that must not be.
void require_free(const scenario::ExerciseFiles& files, const scenario::ExerciseFiles& out,
                  const scenario::Scenario& scenario, const AuthorArguments& arguments) {
    if (arguments.from.empty() && files.solution.empty())
        throw io::InputError("{}: expected a solution, {}, found none; --from RECORDING makes one",
                             files.file.string(), out.solution.string());
    if (arguments.from.empty()) return;
    if (out.solution.parent_path() != out.file.parent_path())
        throw io::InputError("'{}' ships; 'seldinger new NAME --from {}' makes one of your own", files.name,
                             files.name);
    if (!files.solution.empty() && !arguments.replace)
        throw io::InputError("{}: it is there already; --replace makes it anew", files.solution.string());
    require_no_input({{"the solution", out.solution}}, scenario, {arguments.from});
    io::require_writable(out.solution);
}

/// Runs all that takes long. Throws Interrupted.
Found find(const scenario::Scenario& scenario, const scenario::ExerciseFiles& out,
           const script::CommandScript& recording, const AuthorArguments& arguments,
           const anatomy::ModelCache& cache, ProgressBar& bar) {
    const auto or_stop = [](auto&& made) {
        if (!made) throw Interrupted();
        return *std::forward<decltype(made)>(made);
    };
    author::TrialOptions options;
    options.jobs = arguments.jobs;
    options.interrupted = stop_requested;
    const auto show = [&](const char* what, double from, double to) {
        options.progress = [&bar, what, from, to](std::size_t done, std::size_t of) {
            bar.show(from + (to - from) * static_cast<double>(done) / static_cast<double>(of), what);
        };
    };
    Found found;
    const exercise::Exercise start(scenario, exercise::Pictures::None, cache, &recording);
    if (arguments.from.empty()) {
        found.solution.script = recording;
        exercise::Exercise exercise(start);
        found.solution.exact = author::attempt(exercise, recording, author::exact_hand, 0);
    } else {
        show("ranges", 0, 0.1);
        found.solution = or_stop(author::solution_of(recording, out.solution.string(), start, options));
    }
    show("ten inexact hands", 0.1, 0.25);
    found.attempts = or_stop(author::trial(start, found.solution.script, arguments.off / 100, options));
    show("how inexact they may be", 0.25, 0.9);
    found.widest = or_stop(author::widest_off(start, found.solution.script, options));
    bar.show(0.9, "clumsy hands");
    if (found.solution.exact.score.completed)
        found.clumsy =
            author::clumsy_points(start, author::benchmark_for(scenario, found.solution.exact.score));
    return found;
}

void print_trial(const Found& found, const scenario::Scenario& scenario, double off) {
    print("\nTen hands that are off by up to {:g} % of each amount:\n", off);
    print("  {:>4}  {:<7}  {:>7}  {:>10}\n", "hand", "reached", "time", "nearest");
    for (const author::Attempt& one : found.attempts)
        print("  {:>4}  {:<7}  {:>7}  {:>7.2f} mm\n", one.hand, one.score.completed ? "yes" : "NO",
              one.score.completion_time ? fmt::format("{:.2f} s", *one.score.completion_time) : "-",
              one.nearest);
    const auto reached =
        std::ranges::count_if(found.attempts, [](const author::Attempt& one) { return one.score.completed; });
    print(
        "  {} of {} reach the target of {:g} mm; hand 1 does always too much, 2 too little, the others at "
        "random\n",
        reached, found.attempts.size(), scenario.target.radius);
    if (found.widest > 0)
        print("All reach at 1 to {:.0f} %{}.\n", 100 * found.widest,
              found.widest >= author::widest_tried - 1e-9 ? ", the most that was tried" : "");
    else
        print("Not all reach at 1 %.\n");
    const double radius = author::forgiving_radius(found.attempts);
    if (std::isfinite(radius))
        print("The smallest target that all reach with {:g} % off: radius_mm = {:.1f}\n", off,
              std::ceil(10 * radius) / 10);
    else
        print("With {:g} % off not all stay anywhere for {:g} s: the script ends too soon for a radius\n",
              off, scenario.target.hold);
}

/// What those that ship have and this one has not.
void print_standard(const Found& found, const scenario::ExerciseFiles& out,
                    const scenario::Scenario& scenario) {
    std::vector<std::string> said = author::faults_of_solution(scenario, found.solution.exact);
    if (!author::all_reach(found.attempts)) said.push_back("not all of the ten hands reach");
    for (const std::string& missing : author::missing_of_lesson(out, scenario))
        said.push_back(missing + " is missing");
    for (std::size_t k = 0; k < found.clumsy.size() && !scenario.lesson.guided(); ++k)
        if (found.clumsy[k] > author::most_clumsy_points)
            said.push_back(fmt::format("senseless hands {} get {:.0f} points; up to {:g} are right", k + 1,
                                       found.clumsy[k], author::most_clumsy_points));
    print("\n{}\n", said.empty() ? "It is all that exercises that ship are held to."
                                 : "Of what exercises that ship are held to:");
    for (const std::string& one : said) print("  {}\n", one);
}

/// A benchmark of played attempts beside the scenario, unless it has one that people made, or one of this
/// state of the exercise, or is a guided lesson, which nothing is judged in. Throws Interrupted, and has
/// written nothing.
void add_benchmark_of(scenario::Scenario& scenario, const script::CommandScript& solution,
                      const room::Speeds& speeds, const std::filesystem::path& folder,
                      const anatomy::ModelCache& cache) {
    const scenario::Benchmark& known = scenario.lesson.benchmark;
    if (scenario.lesson.guided()) return;
    if (known.given() && (known.by != by_a_program || known.scenario == scenario.content)) return;
    std::vector<exercise::Score> reached;
    for (std::uint64_t seed = 1; seed <= usual_attempts; ++seed) {
        const auto score = played_attempt(scenario, solution, speeds, seed, cache);
        if (!score) throw Interrupted();
        if (score->completed) reached.push_back(*score);
    }
    if (reached.empty()) return;
    const std::filesystem::path file = folder / scenario::benchmark_file;
    std::error_code ignored;
    scenario::Benchmarks all;
    if (std::filesystem::exists(file, ignored)) all = scenario::load_benchmarks(file);
    scenario.lesson.benchmark = all[scenario.name] =
        exercise::benchmark_of(reached, by_a_program, scenario.content);
    io::write_whole(file, scenario::to_toml(all));
}

int author_exercise(const AuthorArguments& arguments) {
    const scenario::ExerciseFiles files = exercise_named(arguments.scenario), out = outputs_of(files);
    scenario::Scenario scenario = load_exercise(files.file);
    require_free(files, out, scenario, arguments);
    const room::Speeds speeds = key_speeds();
    const std::string source = arguments.from.empty() ? files.solution.string() : arguments.from;
    const script::CommandScript recording = script::load_commands(source);
    author::require_recording_of(recording, scenario.name);
    run::check(scenario, recording);
    if (recording.origin && recording.origin->scenario_hash != 0 &&
        recording.origin->scenario_hash != scenario.content)
        tell("note: {}: the scenario '{}' has changed since it was recorded\n", source, scenario.name);
    const bool draws = files.picture.empty() || (arguments.replace && !arguments.from.empty());
    if (draws) io::require_writable(out.picture);
    Found found;
    try {
        ProgressBar bar;
        anatomy::ModelCache cache;
        cache.folder = usual_cache(arguments.cache);
        report_on(bar, cache);
        found = find(scenario, out, recording, arguments, cache, bar);
        bar.show(0.93, "benchmark");
        add_benchmark_of(scenario, found.solution.script, speeds, out.file.parent_path(), cache);
        bar.show(0.97, "picture");
        if (draws) author::write_thumbnail(out.picture, scenario, cache);
        if (!arguments.from.empty()) io::write_whole(out.solution, found.solution.text);
    } catch (const Interrupted&) {
        tell("interrupted: nothing was written\n");
        return interrupted;
    }
    const author::Solution& solution = found.solution;
    if (!arguments.from.empty())
        print("{}: {} commands of {} in {} lines{}\n", out.solution.string(), recording.commands.size(),
              arguments.from, std::ranges::count(solution.text, '\n'),
              solution.dropped > 0
                  ? fmt::format(", without {} pairs of motions that come to nothing", solution.dropped)
                  : "");
    print("{}: {}\n", out.picture.string(), draws ? "the angiogram of its start" : "stays as it is");
    print("The solution {} after {}; nearest {:.2f} mm\n",
          solution.exact.score.completed ? "reaches the target" : "does not reach the target",
          solution.exact.score.completion_time
              ? fmt::format("{:.2f} s", *solution.exact.score.completion_time)
              : "all of it",
          solution.exact.nearest);
    print_trial(found, scenario, arguments.off);
    if (const scenario::Benchmark& skilled = scenario.lesson.benchmark; skilled.given())
        print("\nBenchmark: {} attempts by {}; {:.1f} s, {:.0f} mm on average\n", skilled.attempts,
              skilled.by, skilled.completed_after.mean(), skilled.wire_travel.mean());
    print_standard(found, out, scenario);
    return author::all_reach(found.attempts) ? done : not_reached;
}

}  // namespace

Command add_author(CLI::App& parser) {
    const auto arguments = std::make_shared<AuthorArguments>();
    CLI::App* command = parser.add_subcommand(
        "author",
        "Make a solution of a recording, and say how inexact a hand it forgives\n\n"
        "Examples:\n"
        "  seldinger author mine --from recordings/mine-0001.gw\n"
        "  seldinger author renal                                what the solution that is there forgives");
    add_scenario(command, arguments->scenario);
    command
        ->add_option("--from", arguments->from,
                     "Recording (.gw) of an attempt that reached the target; else NAME.gw is looked over")
        ->type_name("FILE");
    command->add_flag("--replace", arguments->replace, "Replace a NAME.gw and NAME.png that are there");
    command->add_option("--off", arguments->off, "By how much of each amount hands are off [%]")
        ->check(number(0.1, 50))
        ->capture_default_str();
    command->add_option("--jobs", arguments->jobs, "Attempts at the same time; results do not depend on it")
        ->check(whole_number(1, 256));
    add_cache_folder(command, arguments->cache);
    command->footer(
        "NAME.gw has the recording's motions in ranges of frames, beside NAME.toml, and NAME.png is the "
        "angiogram of\n"
        "its start; from then on NAME is an exercise with solution and picture wherever its folder is "
        "searched.\n"
        "Exit codes: 0 all hands reach, 1 not all do, 2 bad input, 130 interrupted.");
    return {command, [arguments] { return author_exercise(*arguments); }};
}

}  // namespace app
