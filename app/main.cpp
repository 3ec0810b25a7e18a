/// The command line: arguments in, exit code out. No rule of the simulation lives here.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fmt/format.h>
#include <optional>
#include <string>

#include "app/anatomy_command.h"
#include "app/progress_bar.h"
#include "engine/error.h"
#include "engine/headless.h"
#include "engine/relax_method.h"
#include "engine/relax_run.h"
#include "engine/still.h"
#include "engine/studies/shards.h"
#include "engine/studies/study.h"

namespace {

using app::ProgressBar;

enum ExitCode { reached = 0, not_reached = 1, bad_input = 2, differs = 3, interrupted = 130 };

volatile std::sig_atomic_t stop_requested = 0;
void request_stop(int) {
    stop_requested = 1;
}

const char* const footer =
    "Exit codes: 0 target reached, 1 not reached, 2 bad input, 3 a state or frame differs from what was "
    "expected,\n"
    "130 interrupted (what was done up to the last whole frame is kept).\n"
    "Commands are lines of 'FRAME verb arguments':\n"
    "  0 beam on          20 arm lao 30 deg cranial 10 deg     120 end\n"
    "  4..60 advance 2 mm 25 contrast 12 mg/ml                 state 60 0123456789abcdef\n"
    "  9 rotate 30 deg    80 withdraw 10 mm, reset             # a comment\n"
    "  30 inject 12 ml at 6 ml/s into aorta of 320 mg/ml       31 mode dsa, live, roadmap; mask; reference\n"
    "  40 pulse 7.5 per second                                 41 collimate 120 90 mm; table 0 0 -40 mm";

struct RunArguments {
    std::string scenario, commands, out, expect, cache, frames = "all";
    int every = 1;
    bool panel = false, truth = false;
};

const std::string shipped = SELDINGER_ASSETS "/scenarios";

int run(const RunArguments& arguments) {
    const engine::Scenario scenario =
        engine::load_scenario(engine::find_scenario(arguments.scenario, shipped));
    const engine::CommandScript script = engine::load_commands(arguments.commands);
    engine::RunOptions options;
    options.every = arguments.every;
    options.images = arguments.frames != "none";
    if (!options.images && (arguments.panel || arguments.truth))
        throw engine::InputError(fmt::format("--frames none: {} needs images; 'all' is accepted with it",
                                             arguments.panel ? "--panel" : "--truth"));
    options.panel = arguments.panel;
    options.truth = arguments.truth;
    options.program = "seldinger " SELDINGER_VERSION;
    if (!arguments.expect.empty()) options.expect = arguments.expect;
    options.cache.folder = arguments.cache;
    options.interrupted = [] { return stop_requested != 0; };

    // A full disk or quota is told by write(), not by a signal that ends the program.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGINT, request_stop);
    std::signal(SIGTERM, request_stop);

    engine::RunResult result;
    {
        ProgressBar bar;
        options.cache.progress = [&bar](double part, const char* what) { bar.show(part, what); };
        options.progress = [&bar](const engine::Progress& p) {
            bar.show(static_cast<double>(p.frame) / p.frames,
                     fmt::format("frame {}/{}  inserted {:.0f} mm  tip to target {:.1f} mm", p.frame,
                                 p.frames, p.inserted, p.tip_to_target));
        };
        result = engine::run_headless(scenario, script, arguments.out, options);
    }
    for (const std::string& notice : result.notices) fmt::print(stderr, "note: {}\n", notice);
    for (const std::string& difference : result.differences) fmt::print(stderr, "{}\n", difference);
    if (result.time_is_up) fmt::print(stderr, "note: the time limit of {} s is over\n", *scenario.time_limit);
    const engine::Score& score = result.score;
    fmt::print("{}: {} frames, {}, tip {:.2f} mm from the target; score in {}/score.json\n", scenario.name,
               result.frames,
               score.completion_time ? fmt::format("target reached after {:.2f} s", *score.completion_time)
                                     : std::string("target not reached"),
               score.tip_to_target, arguments.out);
    if (options.expect) {
        fmt::print("{} states and {} frames compared, {}\n", result.compared_states, result.compared_frames,
                   result.differences.empty() ? "all equal" : "with differences");
    }
    if (result.interrupted) {
        fmt::print(stderr, "interrupted after frame {}; {}/run.gw can be replayed\n", result.frames - 1,
                   arguments.out);
        return interrupted;
    }
    if (!result.differences.empty()) return differs;
    return score.completed ? reached : not_reached;
}

int relax(engine::RelaxRequest request, const engine::RelaxFiles& files) {
    engine::check_files(files, request);
    const bool planes = request.wall == "mesh" && request.method == "global";
    engine::RelaxOutcome outcome;
    {
        ProgressBar bar;
        request.cache.progress = [&bar](double part, const char* what) { bar.show(part, what); };
        if (request.cache.folder.empty()) request.cache.folder = engine::cache_beside(files.joints);
        outcome = engine::run_relax(engine::make_relax_case(request), [&bar](const engine::RelaxProgress& p) {
            bar.show(p.part, fmt::format("{} segments  |g|/C {:.1e}", p.segments, p.gradient));
        });
    }
    engine::write_files(files, outcome);
    fmt::print("{}: {} segments, energy {:.8g} N·mm, |g|/C {:.1e} ({}), {} contacts, {:.3g} s\n",
               outcome.method, outcome.wire.segments(), outcome.energy.total(), outcome.gradient,
               !outcome.converged && planes ? "as near to rest as the mesh's planes let it"
               : !outcome.converged         ? "not converged"
               : outcome.counts_newton_steps && !outcome.strict_minimum ? "converged, not at a strict minimum"
                                                                        : "converged",
               outcome.contacts, outcome.cpu);
    return 0;
}

struct StudyArguments {
    std::string id, out;
    std::vector<std::filesystem::path> folders;  // of shards to merge
    std::optional<std::string> shard;
    bool quick = false;
    int threads = 2;
    std::uint64_t seed = 1;
};

int list_studies() {
    for (const engine::Study& known : engine::all_studies())
        fmt::print("{:<20} {}\n", known.id, known.question);
    fmt::print("{:<20} {}\n", "all", "every one of them, and one page of all pictures and claims");
    fmt::print("{:<20} {}\n", "merge", "makes one run of the folders that --shard left");
    return 0;
}

int study(const StudyArguments& arguments) {
    const std::string& id = arguments.id;
    if (id.empty()) return list_studies();
    const bool all = id == "all", merge = id == "merge";
    const engine::Study* chosen = all || merge ? nullptr : &engine::find_study(id);
    if (arguments.out.empty())
        throw engine::InputError(fmt::format("study {}: --out is missing; a folder is accepted", id));
    if (!merge && !arguments.folders.empty())
        throw engine::InputError(fmt::format("study {}: '{}' was found; folders go with 'study merge'", id,
                                             arguments.folders.front().string()));
    if (arguments.shard && !chosen)
        throw engine::InputError(
            fmt::format("--shard: 'study {}' cannot be cut; it goes with one study", id));
    engine::StudyOptions options;
    const char* meshes = std::getenv("SELDINGER_REAL_MESHES");
    options.real_meshes = meshes ? meshes : SELDINGER_ASSETS "/../../shared/anatomy";
    options.scenarios = shipped;
    options.quick = arguments.quick;
    options.threads = arguments.threads;
    options.seed = arguments.seed;
    options.program = "seldinger " SELDINGER_VERSION;
    std::vector<std::string> notices;
    {
        ProgressBar bar;
        options.progress = [&bar](const engine::StudyProgress& p) {
            bar.show(static_cast<double>(p.done) / p.of, fmt::format("{}/{}  {}", p.done, p.of, p.what));
        };
        if (all)
            notices = engine::run_all_studies(arguments.out, options);
        else if (merge)
            notices = engine::merge_shards(arguments.folders, arguments.out, options);
        else if (arguments.shard)
            engine::run_shard(*chosen, engine::parse_shard(*arguments.shard), arguments.out, options);
        else
            notices = engine::run_study(*chosen, arguments.out, options);
    }
    for (const std::string& notice : notices) fmt::print(stderr, "note: {}\n", notice);
    if (arguments.shard)
        fmt::print("{}: shard {} in {}/shard.json\n", id, *arguments.shard, arguments.out);
    else
        fmt::print("{}: tables and pictures in {}, to be read from {}\n", id, arguments.out,
                   all     ? "index.html"
                   : merge ? "the page there"
                           : id + ".md");
    return 0;
}

/// An option that is empty unless given.
template <class Value>
CLI::Option* add_optional(CLI::App* command, const char* name, std::optional<Value>& value,
                          const char* help) {
    return command->add_option_function<Value>(
        name, [&value](const Value& given) { value = given; }, help);
}

CLI::App* add_relax(CLI::App& app, engine::RelaxRequest& request, engine::RelaxFiles& files) {
    CLI::App* command = app.add_subcommand("relax", "Relax one wire in one vessel from numbers in files");
    add_optional(command, "--tube", request.tube, "CSV of a tube's centreline (x_mm,y_mm,z_mm)");
    add_optional(command, "--radius", request.radius, "Radius of the tube [mm]");
    add_optional(command, "--anatomy", request.anatomy, "NAME.anatomy.json, instead of a tube");
    add_optional(command, "--branch", request.branch, "Branch by whose open end the wire enters");
    command->add_option("--wall", request.wall, "Of an anatomy: distance-field, or mesh, the paper's planes")
        ->check(CLI::IsMember({"distance-field", "mesh"}));
    command->add_option("--cache", request.cache.folder,
                        "Folder that keeps distance fields; else cache beside --out");
    add_optional(command, "--wire", request.wire, "CSV of the wire's joints, from joint 0");
    add_optional(command, "--segments", request.segments, "Segments of a wire laid along the centreline");
    add_optional(command, "--segment-length", request.segment_length, "Their length [mm]");
    command->add_option("--wire-diameter", request.wire_diameter, "Taken off the lumen's [mm]; 0 = a line");
    add_optional(command, "--entry-direction", request.entry_direction,
                 "X,Y,Z; else along the first segment");
    command->add_option("--rigidity", request.rigidity, "EI [N·mm²]")->required();
    command->add_option("--clamp", request.clamp,
                        "What the first and the last joint stand for: half of a segment (second order in "
                        "its length), or paper, a whole one");
    add_optional(command, "--load", request.load,
                 "X,Y,Z, force on the wire per length, as its weight [N/mm]");
    command->add_option("--wall-stiffness", request.wall_stiffness, "k of each joint [N/mm]")->required();
    command->add_option("--method", request.method, "Method of relaxation, see below")->required();
    add_optional(command, "--cycles", request.cycles,
                 "Most relaxation cycles, 300 (with --push-from: 10 a push)");
    add_optional(command, "--tolerance", request.tolerance, "Stop once |gradient| over C is no larger");
    add_optional(command, "--push-from", request.push_from,
                 "Start with so many segments and insert the rest one by one (push.csv beside --out)");
    command->add_option("--out", files.joints, "CSV for the joints")->required();
    command->add_option("--report", files.report, "JSON for energy, gradient, contacts, work, time")
        ->required();
    command->footer(std::string(engine::method_words) +
                    "Exit codes: 0 done (the report says whether it converged), 2 bad input.");
    return command;
}

struct RenderArguments {
    std::string scenario, commands, out, cache, mode = "live";
    int frame = 0;
    std::optional<double> lao, cranial;  // [deg]
    double iodine = 60;
};

int render_image(const RenderArguments& arguments) {
    engine::check_still(arguments.out);
    const engine::Scenario scenario =
        engine::load_scenario(engine::find_scenario(arguments.scenario, shipped));
    engine::CommandScript script;
    if (const std::string own = SELDINGER_ASSETS "/scripts/" + scenario.name + ".gw";
        !arguments.commands.empty())
        script = engine::load_commands(arguments.commands);
    else if (std::filesystem::exists(own))
        script = engine::load_commands(own);
    engine::StillRequest request;
    request.frame = arguments.frame;
    if (arguments.lao) request.lao = *arguments.lao * physics::kDegree;
    if (arguments.cranial) request.cranial = *arguments.cranial * physics::kDegree;
    request.mode = static_cast<engine::ImagingMode>(
        std::find(engine::imaging_modes.begin(), engine::imaging_modes.end(), arguments.mode) -
        engine::imaging_modes.begin());
    request.iodine = arguments.iodine;
    engine::ModelCache cache;
    cache.folder = arguments.cache.empty() ? engine::cache_beside(arguments.out).string() : arguments.cache;
    ProgressBar bar;
    cache.progress = [&bar](double part, const char* what) { bar.show(part, what); };
    engine::write_still(arguments.out, engine::render_still(scenario, script, request, cache));
    return 0;
}

CLI::App* add_render(CLI::App& app, RenderArguments& arguments) {
    CLI::App* command = app.add_subcommand("render", "One image of a scenario, from any side");
    command
        ->add_option("scenario", arguments.scenario, "A scenario file (.toml), or the name of one that ships")
        ->required();
    command->add_option(
        "--commands", arguments.commands,
        "Command script or recording (.gw); else the one that ships with the scenario, if any");
    command->add_option("--frame", arguments.frame, "The frame to show; its script runs up to it")
        ->check(CLI::Range(0, engine::largest_frame));
    add_optional(command, "--lao", arguments.lao, "Angle of the arm, RAO negative [deg]");
    add_optional(command, "--cranial", arguments.cranial, "Angle of the arm, caudal negative [deg]");
    command->add_option("--mode", arguments.mode, "live, dsa or roadmap")
        ->check(CLI::IsMember(
            std::vector<std::string>(engine::imaging_modes.begin(), engine::imaging_modes.end())));
    command
        ->add_option("--iodine", arguments.iodine,
                     "DSA and roadmap: fills the vessels where the script left no contrast [mg/ml]")
        ->check(CLI::Range(1.0, engine::largest_iodine));
    command->add_option("--out", arguments.out, "The image, a .png")->required();
    command->add_option("--cache", arguments.cache,
                        "Folder that keeps grown vessels and distance fields; else cache beside --out");
    return command;
}

int list() {
    for (const std::filesystem::path& file : engine::shipped_scenarios(shipped)) {
        fmt::print("{:<16} {}\n", file.stem().string(), engine::load_scenario(file).title);
    }
    return 0;
}

}  // namespace

int main(int count, char** values) {
    CLI::App app("Guidewire training simulator", "seldinger");
    app.set_version_flag("--version", "seldinger " SELDINGER_VERSION);
    app.footer(footer);
    app.require_subcommand(1);

    RunArguments arguments;
    CLI::App* run_command =
        app.add_subcommand("run", "Run a scenario from a file of commands, without a display");
    run_command
        ->add_option("scenario", arguments.scenario, "A scenario file (.toml), or the name of one that ships")
        ->required();
    run_command->add_option("--commands", arguments.commands, "Command script or recording (.gw)")
        ->required();
    run_command->add_option("--out", arguments.out, "Folder for run.gw, score.json, sheet.png and frames/")
        ->required();
    run_command->add_option("--every", arguments.every, "Write an image of every K-th frame, and of the last")
        ->check(CLI::Range(1, engine::largest_frame));
    run_command->add_option("--frames", arguments.frames, "'all', or 'none' for no images at all")
        ->check(CLI::IsMember({"all", "none"}));
    run_command->add_flag("--panel", arguments.panel,
                          "The image amid the readouts of the room, in colour, in panel/");
    run_command->add_flag(
        "--truth", arguments.truth,
        "Ground truth of every image in truth/: wire, tip and vessels in pixels, masks, camera");
    run_command->add_option(
        "--expect", arguments.expect,
        "Recording, or output folder of an earlier run, that states and frames must equal");
    run_command->add_option("--cache", arguments.cache,
                            "Folder that keeps grown vessels and distance fields; else cache beside --out");
    run_command->footer(footer);
    CLI::App* list_command = app.add_subcommand("list", "List the scenarios that ship");

    engine::RelaxRequest request;
    engine::RelaxFiles files;
    CLI::App* relax_command = add_relax(app, request, files);

    RenderArguments still;
    CLI::App* render_command = add_render(app, still);

    app::AnatomyCommand anatomy_command(app);

    StudyArguments study_arguments;
    CLI::App* study_command = app.add_subcommand("study", "Run a study, or without an ID list them");
    study_command->add_option("id", study_arguments.id, "Which study, or 'all', or 'merge'");
    study_command->add_option("folders", study_arguments.folders, "Of 'merge': those that --shard left");
    study_command->add_option("--out", study_arguments.out, "Folder for tables and pictures");
    study_command->add_flag("--quick", study_arguments.quick,
                            "Shorter wires, less work: a try, not a result");
    study_command->add_option("--threads", study_arguments.threads, "Threads; results do not depend on them")
        ->check(CLI::Range(1, 256));
    add_optional(study_command, "--shard", study_arguments.shard,
                 "i/n: the i-th of n equal parts, for 'merge' (wall-variation)");
    study_command->add_option("--seed", study_arguments.seed, "Of a study that draws random numbers")
        ->check(CLI::Range(0.0, 9e15));

    try {
        app.parse(count, values);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : bad_input;
    }
    try {
        if (*list_command) return list();
        if (*render_command) return render_image(still);
        if (*relax_command) return relax(request, files);
        if (*study_command) return study(study_arguments);
        if (anatomy_command.given()) return anatomy_command.run();
        return run(arguments);
    } catch (const std::exception& error) {
        fmt::print(stderr, "seldinger: {}\n", error.what());
        return bad_input;
    }
}
