/// `seldinger run`.

#include <algorithm>
#include <fmt/format.h>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/io/error.h"
#include "engine/run/headless.h"

namespace app {
namespace {

const char* const footer =
    "Exit codes: 0 target reached, 1 not reached, 2 bad input, 3 a state or frame differs from what was "
    "expected,\n"
    "130 interrupted (what was done up to the last whole frame is kept).\n"
    "Commands are lines of 'FRAME verb arguments':\n"
    "  0 beam on          20 arm lao 30 deg cranial 10 deg     120 end\n"
    "  4..60 advance 2 mm 25 contrast 12 mg/ml                 state 60 0123456789abcdef\n"
    "  9 rotate 30 deg    80 withdraw 10 mm, reset             # a comment\n"
    "  30 inject 12 ml at 6 ml/s into aorta of 320 mg/ml       31 mode dsa, live, roadmap; mask; reference\n"
    "  32 advance catheter 5 mm; rotate all 20 deg             33 remove wire; exchange wire rosen035\n"
    "  34 inject 6 ml at 3 ml/s through catheter\n"
    "  40 pulse 7.5 per second                                 41 collimate 120 90 mm; table 0 0 -40 mm\n"
    "  50 complication spasm of LRA at 10 mm over 20 mm by 60 percent   90 relieve all";

struct RunArguments {
    std::vector<std::string> set;
    ScenarioChoice scenario;
    std::string commands, out, expect, cache, trace, learner, frames = "all", dicom;
    std::vector<std::string> truth_of;
    int every = 1;
    bool panel = false, truth = false;
};

int run_scenario(const RunArguments& arguments) {
    const scenario::ExerciseFiles files = exercise_named(arguments.scenario);
    const scenario::Scenario scenario = load_exercise(files.file, arguments.set, arguments.scenario.patient);
    std::optional<std::string> typed;
    if (arguments.commands == "-") {
        typed = std::string(std::istreambuf_iterator<char>(std::cin), {});
        if (stop_requested()) return interrupted;  // a signal ends the reading, in mid-script
    }
    const bool solves = arguments.commands == "solution";
    if (solves && files.solution.empty())
        throw io::InputError("--commands solution: '{0}' has none; expected {0}.gw beside {1}", files.name,
                             files.file.string());
    const script::CommandScript script =
        typed ? script::parse_commands(*typed, "standard input")
              : script::load_commands(solves ? files.solution.string() : arguments.commands);
    run::RunOptions options;
    options.every = arguments.every;
    options.images = arguments.frames != "none";
    if (!options.images &&
        (arguments.panel || arguments.truth || !arguments.truth_of.empty() || !arguments.dicom.empty()))
        throw io::InputError("--frames none: {} needs images; expected --frames all",
                             arguments.panel              ? "--panel"
                             : arguments.truth            ? "--truth"
                             : arguments.truth_of.empty() ? "--dicom"
                                                          : "--truth-of");
    options.panel = arguments.panel;
    options.truth = arguments.truth || !arguments.truth_of.empty();
    const auto asked = [&](const char* part) { return std::ranges::count(arguments.truth_of, part) > 0; };
    options.truth_parts = {asked("signal"), asked("expected"), asked("labels"), asked("lengths")};
    if (!arguments.dicom.empty())
        options.dicom = arguments.dicom == "shown" ? dicom::Pixels::Shown : dicom::Pixels::Signal;
    options.trace = arguments.trace;
    options.origin = origin(arguments.learner);
    if (!arguments.expect.empty()) options.expect = arguments.expect;
    options.cache.folder = arguments.cache;
    options.interrupted = stop_requested;

    run::RunResult result;
    {
        ProgressBar bar;
        report_on(bar, options.cache);
        options.progress = [&bar](const run::Progress& p) {
            bar.show(static_cast<double>(p.frame) / p.frames,
                     fmt::format("frame {}/{}  inserted {:.0f} mm  tip to target {:.1f} mm", p.frame,
                                 p.frames, p.inserted, p.tip_to_target));
        };
        result = run::run_headless(scenario, script, arguments.out, options);
    }
    for (const std::string& notice : result.notices) tell("note: {}\n", notice);
    for (const std::string& difference : result.differences) tell("{}\n", difference);
    if (result.time_is_up) tell("note: the time limit of {} s is over\n", *scenario.time_limit);
    const exercise::Score& score = result.score;
    print("{}: {} frames, {}, tip {:.2f} mm from the target; score in {}/score.json\n", scenario.name,
          result.frames,
          score.completion_time ? fmt::format("target reached after {:.2f} s", *score.completion_time)
                                : std::string("target not reached"),
          score.tip_to_target, arguments.out);
    if (options.expect) {
        print("{} states and {} frames compared, {}\n", result.compared_states, result.compared_frames,
              !result.differences.empty()                           ? "with differences"
              : result.compared_states + result.compared_frames > 0 ? "all equal"
                                                                    : "so nothing is known");
    }
    if (result.interrupted) {
        tell("interrupted after frame {}; {}/run.gw can be replayed\n", result.frames - 1, arguments.out);
        return interrupted;
    }
    if (!result.differences.empty()) return differs;
    return score.completed ? done : not_reached;
}

}  // namespace

Command add_run(CLI::App& parser) {
    const auto arguments = std::make_shared<RunArguments>();
    CLI::App* command =
        parser.add_subcommand("run", "Run a scenario from a file of commands, without a display");
    add_scenario(command, arguments->scenario);
    add_patient(command, arguments->scenario);
    command
        ->add_option(
            "--commands", arguments->commands,
            "Command script or recording (.gw); 'solution' is the exercise's; - reads standard input")
        ->required();
    command->add_option("--out", arguments->out, "Folder for run.gw, score.json, sheet.png and frames/")
        ->required();
    command->add_option(
        "--set", arguments->set,
        "KEY=VALUE in place of the scenario's, such as guidewire.friction=0.1; again for more");
    command->add_option("--learner", arguments->learner, "Whose recording it is: a name, for 'course'");
    command->add_option("--every", arguments->every, "Write an image of every K-th frame, and of the last")
        ->check(CLI::Range(1, script::largest_frame));
    command->add_option("--frames", arguments->frames, "'all', or 'none' for no images at all")
        ->check(CLI::IsMember({"all", "none"}));
    command->add_flag("--panel", arguments->panel,
                      "The image amid the readouts of the room, in colour, in panel/");
    command->add_flag(
        "--truth", arguments->truth,
        "Ground truth of every image in truth/: wire, tip and vessels in pixels, masks, camera");
    command
        ->add_option(
            "--truth-of", arguments->truth_of,
            "More of it, in 16 bits: the detector's 'signal', what is 'expected' of it without noise, "
            "'labels' of the vessels, 'lengths' of rays in each layer of the patient; with commas")
        ->delimiter(',')
        ->check(CLI::IsMember({"signal", "expected", "labels", "lengths"}));
    command
        ->add_option(
            "--dicom", arguments->dicom,
            "X-ray angiograms in dicom/, one for each stretch of beam at one pose: 'shown', as on the "
            "monitor, or 'signal', the detector's in 16 bits")
        ->check(CLI::IsMember({"shown", "signal"}));
    command->add_option("--trace", arguments->trace,
                        "File for the state of each frame: place, forces, way left, dose (.csv)");
    command->add_option("--expect", arguments->expect,
                        "Recording, or output folder of an earlier run, that states and frames must equal");
    add_cache_folder(command, arguments->cache, "cache beside --out");
    command->footer(footer);
    return {command, [arguments] { return run_scenario(*arguments); }};
}

}  // namespace app
