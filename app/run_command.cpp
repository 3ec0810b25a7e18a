/// `seldinger run`.

#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/progress_bar.h"
#include "app/signature.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/run/headless.h"

namespace app {
namespace {

struct RunArguments {
    std::vector<std::string> set;
    ScenarioChoice scenario;
    std::string commands, out, expect, cache, trace, learner, frames = "all", dicom, dicom_date,
                                                              dicom_patient, sign;
    std::vector<std::string> truth_of;
    int every = 1;
    bool panel = false, truth = false, slicer = false;
};

int run_scenario(const RunArguments& arguments) {
    const scenario::ExerciseFiles files = exercise_named(arguments.scenario);
    const scenario::Scenario scenario = load_exercise(files.file, arguments.set, arguments.scenario.patient);
    const script::CommandScript script = required_script(files, arguments.commands);
    run::RunOptions options;
    options.every = arguments.every;
    options.images = arguments.frames != "none";
    if (!options.images &&
        (arguments.panel || arguments.truth || !arguments.truth_of.empty() || !arguments.dicom.empty()))
        throw BadArgument("--frames none: expected 'all', as {} needs images", arguments.panel   ? "--panel"
                                                                               : arguments.truth ? "--truth"
                                                                               : arguments.truth_of.empty()
                                                                                   ? "--dicom"
                                                                                   : "--truth-of");
    options.panel = arguments.panel;
    options.truth = arguments.truth || !arguments.truth_of.empty();
    const auto asked = [&](const char* part) { return std::ranges::count(arguments.truth_of, part) > 0; };
    options.truth_parts = {asked("signal"), asked("expected"), asked("labels"), asked("lengths")};
    if (!arguments.dicom.empty())
        options.dicom = arguments.dicom == "shown" ? dicom::Pixels::Shown : dicom::Pixels::Signal;
    if (arguments.dicom.empty() && !(arguments.dicom_date.empty() && arguments.dicom_patient.empty()))
        throw BadArgument("{}: expected --dicom shown or --dicom signal beside it",
                          arguments.dicom_date.empty() ? "--dicom-patient" : "--dicom-date");
    if (!arguments.dicom_date.empty()) dicom::read_date(arguments.dicom_date, options.dicom_identity);
    if (!arguments.dicom_patient.empty())
        dicom::read_patient(arguments.dicom_patient, options.dicom_identity);
    options.slicer = arguments.slicer;
    options.trace = arguments.trace;
    options.origin = origin(arguments.learner);
    if (!arguments.expect.empty()) options.expect = arguments.expect;
    options.cache.folder = arguments.cache;
    options.interrupted = stop_requested;
    std::optional<SigningKey> key;
    if (!arguments.sign.empty()) {
        options.also_read = {arguments.sign};
        key.emplace(arguments.sign);
    }

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
    if (key) key->sign(std::filesystem::path(arguments.out) / "run.gw");
    for (const std::string& notice : result.notices) tell("note: {}\n", notice);
    for (const std::string& difference : result.differences) tell("{}\n", difference);
    if (result.time_is_up) tell("note: the time limit of {} s is over\n", *scenario.time_limit);
    const exercise::Score& score = result.score;
    print(
        "{}: {} frames, {}; at the end the tip is {:.2f} mm from its middle (target: {:g} mm); score in "
        "{}/score.json\n",
        scenario.name, result.frames,
        score.completion_time ? fmt::format("target reached after {:.2f} s", *score.completion_time)
                              : std::string("target not reached"),
        score.tip_to_target, scenario.target.radius, arguments.out);
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
        parser.add_subcommand("run",
                              "Run a scenario from a file of commands, without a display\n\n"
                              "Examples:\n"
                              "  seldinger run renal --commands solution --out renal\n"
                              "  seldinger run my.toml --commands my.gw --out out --frames none "
                              "--set guidewire.friction=0.1");
    add_scenario(command, arguments->scenario);
    add_patient(command, arguments->scenario);
    add_script(command, arguments->commands)->required();
    command->add_option("--out", arguments->out, "Folder for run.gw, score.json, sheet.png and frames/")
        ->required()
        ->type_name("FOLDER");
    add_overrides(command, arguments->set);
    add_learner(command, arguments->learner);
    command->add_option("--every", arguments->every, "Write an image of every K-th frame, and of the last")
        ->check(whole_number(1, script::largest_frame));
    command->add_option("--frames", arguments->frames, "'none' for no images at all")
        ->check(one_of({"all", "none"}));
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
        ->check(one_of({"signal", "expected", "labels", "lengths"}));
    command
        ->add_option(
            "--dicom", arguments->dicom,
            "X-ray angiograms in dicom/, one for each stretch of beam at one pose: 'shown', as on the "
            "monitor, or 'signal', the detector's in 16 bits")
        ->check(one_of({"shown", "signal"}));
    command
        ->add_option("--dicom-date", arguments->dicom_date,
                     "Date of these objects, also with a time: 2026-11-27T14:05:00; by default 2000-01-01, "
                     "the same for all "
                     "runs, so that equal runs give equal bytes")
        ->type_name("DATE");
    command
        ->add_option("--dicom-patient", arguments->dicom_patient,
                     "Name and ID of the patient in these objects: Doe^Jane,4711; by default the scenario's. "
                     "Nothing of a CT's "
                     "patient is ever written")
        ->type_name("NAME[,ID]");
    command->add_flag(
        "--slicer", arguments->slicer,
        "Markups of 3D Slicer in slicer/: each device at the end, the way of its tip, and the poses of "
        "the C-arm under which the beam was on");
    command
        ->add_option("--trace", arguments->trace,
                     "File for the state of each frame: place, forces, way left, dose (.csv)")
        ->type_name("FILE");
    command
        ->add_option("--expect", arguments->expect,
                     "Recording, or output folder of an earlier run, that states and frames must equal")
        ->type_name("FILE");
    add_sign(command, arguments->sign);
    add_cache_folder(command, arguments->cache, "cache beside --out");
    command->footer(
        "'seldinger help script' has the commands of scripts.\n"
        "Exit codes: 0 target reached, 1 not reached, 2 bad input, 3 a state or frame differs from what was "
        "expected,\n"
        "130 interrupted (what was done up to the last whole frame is kept).");
    return {command, [arguments] { return run_scenario(*arguments); }};
}

}  // namespace app
