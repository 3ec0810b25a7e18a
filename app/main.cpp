/// The command line: arguments in, exit code out. No rule of the simulation lives here.

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <string>
#include <unistd.h>

#include "engine/headless.h"

namespace {

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
    "  9 rotate 30 deg    80 withdraw 10 mm, reset             # a comment";

/// One line on a terminal, rewritten; nothing where it would end up in a file.
class ProgressBar {
public:
    ProgressBar() : shown_(isatty(STDERR_FILENO) != 0) {}
    ~ProgressBar() {
        if (drawn_) std::fputs("\r\033[K", stderr);
    }
    void operator()(const engine::Progress& p) {
        if (!shown_) return;
        const auto now = Clock::now();
        if (p.frame < p.frames && now - last_ < std::chrono::milliseconds(100)) return;
        last_ = now;
        drawn_ = true;
        const double spent = std::chrono::duration<double>(now - start_).count();
        const int filled = static_cast<int>(30.0 * p.frame / p.frames);
        fmt::print(stderr,
                   "\r\033[K[{}{}] frame {}/{}  inserted {:.0f} mm  tip to target {:.1f} mm  {:.0f} s left",
                   std::string(filled, '#'), std::string(30 - filled, '.'), p.frame, p.frames, p.inserted,
                   p.tip_to_target, spent / p.frame * (p.frames - p.frame));
        std::fflush(stderr);
    }

private:
    using Clock = std::chrono::steady_clock;
    bool shown_ = false, drawn_ = false;
    Clock::time_point start_ = Clock::now(), last_ = start_ - std::chrono::seconds(1);
};

struct RunArguments {
    std::string scenario, commands, out, expect, frames = "all";
    int every = 1;
};

const std::string shipped = SELDINGER_ASSETS "/scenarios";

int run(const RunArguments& arguments) {
    const engine::Scenario scenario =
        engine::load_scenario(engine::find_scenario(arguments.scenario, shipped));
    const engine::CommandScript script = engine::load_commands(arguments.commands);
    engine::RunOptions options;
    options.every = arguments.every;
    options.images = arguments.frames != "none";
    options.program = "seldinger " SELDINGER_VERSION;
    if (!arguments.expect.empty()) options.expect = arguments.expect;
    options.interrupted = [] { return stop_requested != 0; };

    // A full disk or quota is told by write(), not by a signal that ends the program.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGINT, request_stop);
    std::signal(SIGTERM, request_stop);

    engine::RunResult result;
    {
        ProgressBar bar;
        options.progress = [&bar](const engine::Progress& progress) { bar(progress); };
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
    run_command->add_option(
        "--expect", arguments.expect,
        "Recording, or output folder of an earlier run, that states and frames must equal");
    run_command->footer(footer);
    CLI::App* list_command = app.add_subcommand("list", "List the scenarios that ship");

    try {
        app.parse(count, values);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : bad_input;
    }
    try {
        return *list_command ? list() : run(arguments);
    } catch (const std::exception& error) {
        fmt::print(stderr, "seldinger: {}\n", error.what());
        return bad_input;
    }
}
