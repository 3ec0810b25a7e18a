/// `seldinger score` and `seldinger replay`: what a recording was worth, and whether it is one.

#include <chrono>
#include <fmt/format.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/json.h"
#include "app/progress_bar.h"
#include "app/signature.h"
#include "engine/anatomy/organs.h"
#include "engine/exercise/grade.h"
#include "engine/exercise/score.h"
#include "engine/exercise/score_file.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/run/headless.h"
#include "engine/script/recording.h"
#include "physics/geometry/vec.h"

namespace app {
namespace {

const char* const exit_codes =
    "Exit codes: 0 done, 2 bad input, 3 a state differs from what the recording states, or it has no valid "
    "signature by --key, 130 interrupted.";

/// A recording without a valid signature, where one is asked for.
struct NotSigned : io::InputError {
    using InputError::InputError;
};

struct ScoreArguments {
    ScenarioChoice scenario;
    std::string file, out, cache, key;
    std::optional<PublicKey> signer = {};  // of `key`
    bool force = false, json = false;
};

struct Replayed {
    scenario::Scenario scenario;
    script::CommandScript recording;
    run::RunResult result;
    double seconds = 0;  // that the frames took
};

/// Plays the recording without images. Throws InputError for one of another scenario or anatomy, unless
/// forced, and NotSigned.
Replayed replayed(const std::filesystem::path& file, const ScoreArguments& arguments) {
    Replayed played;
    const std::string text = io::read_text(file, "command file", "expected lines of 'frame verb arguments'");
    if (arguments.signer)
        if (const std::string why = arguments.signer->distrust(text); !why.empty())
            throw NotSigned("{} does not count: {}", file.string(), why);
    played.recording = script::parse_commands(text, file.string());
    played.scenario = scenario_of(played.recording, arguments.scenario);
    require_no_input({{"--out", arguments.out}}, played.scenario, {file, arguments.key});
    if (!arguments.out.empty()) io::require_writable(arguments.out);
    run::RunOptions options;
    options.images = false;
    options.cache.folder = usual_cache(arguments.cache);
    options.same_origin = !arguments.force;
    options.interrupted = stop_requested;
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> first;
    {
        ProgressBar bar;
        report_on(bar, options.cache);
        options.progress = [&bar, &first](const run::Progress& p) {
            if (!first) first = Clock::now();
            bar.show(static_cast<double>(p.frame) / p.frames, fmt::format("frame {}/{}", p.frame, p.frames));
        };
        played.result = run::run_headless(played.scenario, played.recording, options);
    }
    if (first) played.seconds = std::chrono::duration<double>(Clock::now() - *first).count();
    for (const std::string& notice : played.result.notices) tell("note: {}\n", notice);
    const auto& origin = played.recording.origin;
    if (origin && origin->program_hash != 0 && origin->program_hash != app::origin().program_hash)
        tell(
            "note: it was recorded by another build ({}); the states show whether this one does "
            "the same\n",
            origin->program);
    if (!played.recording.end)
        tell("note: {} has no end: the program that recorded it was stopped, or lines are missing\n",
             file.string());
    if (origin && origin->free_practice)
        tell("note: {} is free practice: seconds may have been taken back\n", file.string());
    for (const std::string& difference : played.result.differences) tell("{}\n", difference);
    return played;
}

int verdict(const Replayed& played) {
    if (played.result.interrupted) return interrupted;
    return played.result.differences.empty() ? done : differs;
}

void print_line(const std::string& name, const std::string& value) {
    print("  {:<34} {}\n", name, value);
}

void print_treatment(const exercise::TreatmentScore& score) {
    const auto print_all = [](const std::vector<exercise::TreatmentFigure>& rows) {
        for (const exercise::TreatmentFigure& row : rows)
            print_line(row.name, row.before.empty() ? row.now : row.before + " before, " + row.now + " now");
    };
    for (const exercise::LesionScore& lesion : score.lesions) {
        print("  lesion: {}\n", exercise::name_of(lesion));
        print_all(exercise::figures_of(lesion));
    }
    print_all(exercise::figures_of(score));
}

void print_score(const exercise::Score& s, const scenario::Benchmark& benchmark) {
    const auto number = [](std::optional<double> value, const char* unit, int digits) {
        return value ? fmt::format("{:.{}f} {}", *value, digits, unit) : std::string("-");
    };
    if (benchmark.given()) {
        const exercise::Grade grade = exercise::grade(s, benchmark);
        print("  {:<34} {:>12} {:>16} {:>8}\n", "", "yours", "skilled", "costs");
        for (const exercise::GradeLine& line : grade.lines) {
            print("  {:<34} {:>12} {:>16} {:>8.1f}{}\n", line.measure->name, exercise::own_text(line),
                  exercise::skilled_text(line), line.cost, line.unseen ? "  no angiogram" : "");
        }
        print("  {:<34} {:>12} {:>16} {:>8.1f}\n", "Injuries of the wall",
              grade.dissections + grade.perforations, "", grade.cost_of_injuries());
        print("  {:<34} {:.0f} of 100\n  ({})\n  skilled: {} attempts by {}\n\n", "Points", grade.points,
              exercise::grade_formula, benchmark.attempts, benchmark.by);
    }
    print_line("target", s.completed ? fmt::format("reached after {:.2f} s, {:.2f} s after the first motion",
                                                   *s.completed_after, *s.completion_time)
                                     : "not reached");
    print_line("beam", fmt::format("{:.1f} s, {} pulses, {} DSA runs, {} views", s.beam_on_time, s.pulses,
                                   s.runs, s.views));
    print_line("contrast", number(s.contrast, "ml", 1));
    print_line("travel", fmt::format("{:.0f} mm, {} reversals, back and forth {:.2f}", s.wire_travel,
                                     s.reversals, s.back_and_forth_ratio));
    print_line("turned", number(s.rotation / geometry::degree, "deg", 0));
    print_line("idle", number(100 * s.idle_fraction, "%", 0));
    print_line("tip", fmt::format("path {:.0f} mm, efficiency {:.2f}, {:.1f} mm/s", s.tip_path,
                                  s.path_efficiency, s.mean_tip_speed));
    print_line("smoothness (SPARC, LDLJ)",
               number(s.spectral_arc_length, "", 2) + " " + number(s.log_dimensionless_jerk, "", 2));
    print_line("wall force",
               fmt::format("{:.2f} N at most, {:.2f} N on average, {:.1f} s above {:g} N, {:.1f} N s",
                           s.peak_wall_force, s.mean_wall_force, s.time_over_force,
                           exercise::HandlingErrorLimits().force, s.wall_force_impulse));
    if (s.treatment) print_treatment(*s.treatment);
    for (const exercise::WrongBranch& branch : s.wrong_branches)
        print_line("wrong: " + anatomy::clinical_name(branch.name),
                   fmt::format("{} time{}, {:.1f} s", branch.entries, branch.entries == 1 ? "" : "s",
                               branch.seconds));
    for (const exercise::HandlingErrorMark& mark : s.handling_errors) {
        const auto kind = static_cast<std::size_t>(mark.kind);
        print_line(fmt::format("error at {:.1f} s, frame {}", mark.start, mark.first),
                   fmt::format("{} ({}, in {})", exercise::handling_error_texts[kind],
                               exercise::amount_text(mark), exercise::place_text(mark)));
    }
    if (!s.teacher.empty()) print_line(exercise::heading_of(s.teacher), exercise::text_of(s.teacher));
}

int score(const std::filesystem::path& file, const ScoreArguments& arguments, Json& all) {
    const Replayed played = replayed(file, arguments);
    const run::RunResult& result = played.result;
    const script::Origin origin = played.recording.origin.value_or(script::Origin());
    const std::string patient = played.scenario.patient_text();
    const std::string score_json =
        exercise::to_json({origin.program, origin.learner, result.score, result.earlier, result.benchmark});
    if (!arguments.out.empty()) io::write_whole(arguments.out, score_json);
    if (arguments.json) {
        all.push_back({{"file", file.string()},
                       {"error", nullptr},
                       {"exercise", played.scenario.name},
                       {"title", played.scenario.title},
                       {"patient", patient},
                       {"frames", result.frames},
                       {"states_compared", result.compared_states},
                       {"differences", result.differences},
                       {"score", Json::parse(score_json)}});
        return verdict(played);
    }
    print("{}: {}{}{}\n", file.string(), played.scenario.title, patient.empty() ? "" : ", " + patient,
          origin.learner.empty() ? "" : ", by " + origin.learner);
    const double simulated = result.frames / played.scenario.frame_rate;
    print("{} frames, {} states compared, {}; {:.0f} times as fast as it was played\n\n", result.frames,
          result.compared_states, result.differences.empty() ? "all equal" : "with differences",
          played.seconds > 0 ? simulated / played.seconds : 0.0);
    for (std::size_t k = 0; k < result.earlier.size(); ++k)
        print("attempt {}: {}\n", k + 1, result.earlier[k].completed ? "reached" : "not reached");
    print_score(result.score, result.benchmark);
    if (!patient.empty() && result.benchmark.given())
        print("  The skilled attempts are of the first patient.\n");
    return verdict(played);
}

int replay(const std::filesystem::path& file, const ScoreArguments& arguments, Json&) {
    const Replayed played = replayed(file, arguments);
    const run::RunResult& result = played.result;
    print("{}: {} frames of '{}', {} states compared, {}\n", file.string(), result.frames,
          played.scenario.name, result.compared_states,
          result.compared_states == 0  ? "so nothing is shown"
          : result.differences.empty() ? "all equal"
                                       : "with differences");
    return verdict(played);
}

/// Does it for the recording, or for every one of a folder, where one that cannot be played does not keep the
/// others from it. Returns the exit code that asks for most attention.
int for_each(const ScoreArguments& arguments,
             int (*work)(const std::filesystem::path&, const ScoreArguments&, Json&), Json& all) {
    const auto one = [&](const std::filesystem::path& file) -> int {
        try {
            return work(file, arguments, all);
        } catch (const NotSigned& error) {
            tell("{}\n", error.what());
            all.push_back({{"file", file.string()}, {"error", error.what()}});
            return differs;
        }
    };
    std::error_code ignored;
    if (!std::filesystem::is_directory(arguments.file, ignored)) return one(arguments.file);
    const std::vector<std::filesystem::path> files = script::recordings_of(arguments.file);
    if (!arguments.out.empty() && files.size() > 1)
        throw io::InputError("--out {}: expected one recording, found {} in {}", arguments.out, files.size(),
                             arguments.file);
    int worst = done;
    for (const std::filesystem::path& file : files) {
        int code = bad_input;
        try {
            code = one(file);
        } catch (const io::InputError& error) {
            tell("{}\n", error.what());
            all.push_back({{"file", file.string()}, {"error", error.what()}});
        }
        if (code == interrupted) return code;
        if (worst != bad_input && code != done) worst = code;
    }
    return worst;
}

int score_all(ScoreArguments& arguments) {
    if (!arguments.key.empty()) arguments.signer.emplace(arguments.key);
    Json all = Json::array();
    const int code = for_each(arguments, score, all);
    if (arguments.json && code != interrupted) print_json({{"schema", 1}, {"recordings", all}});
    return code;
}

int replay_all(ScoreArguments& arguments) {
    if (!arguments.key.empty()) arguments.signer.emplace(arguments.key);
    Json none;
    return for_each(arguments, replay, none);
}

CLI::App* add(CLI::App& parser, const char* name, const char* what, ScoreArguments& arguments) {
    CLI::App* command = parser.add_subcommand(name, what);
    command->add_option("file", arguments.file, "A recording (.gw), or a folder of recordings")
        ->required()
        ->type_name("FILE");
    add_scenario_of_recording(command, arguments.scenario);
    add_key(command, arguments.key, "without a valid signature nothing is played");
    command->add_flag("--force", arguments.force,
                      "Go on where scenario or anatomy have changed since it was recorded");
    add_cache_folder(command, arguments.cache);
    return command;
}

}  // namespace

Command add_score(CLI::App& parser) {
    const auto arguments = std::make_shared<ScoreArguments>();
    CLI::App* command = add(parser, "score",
                            "The score of a recording, from its commands alone\n\n"
                            "Examples:\n"
                            "  seldinger score hello/run.gw\n"
                            "  seldinger score recordings --json",
                            *arguments);
    command->add_option("--out", arguments->out, "File for the score (.json)")->type_name("FILE");
    add_json(command, arguments->json);
    command->footer(exit_codes);
    return {command, [arguments] { return score_all(*arguments); }};
}

Command add_replay(CLI::App& parser) {
    const auto arguments = std::make_shared<ScoreArguments>();
    CLI::App* command = add(parser, "replay",
                            "Play a recording and check that it leads to the states it states\n\n"
                            "Examples:\n"
                            "  seldinger replay hello/run.gw\n"
                            "  seldinger replay recordings",
                            *arguments);
    command->footer(exit_codes);
    return {command, [arguments] { return replay_all(*arguments); }};
}

}  // namespace app
