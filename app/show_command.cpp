/// `seldinger show`: a scenario's vessels with names, and the way of its wire.

#include <memory>
#include <string>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/anatomy/anatomy_picture.h"
#include "engine/io/files.h"
#include "engine/run/headless.h"

namespace app {
namespace {

struct ShowArguments {
    ScenarioChoice scenario;
    std::string commands, out, cache;
};

int show(const ShowArguments& arguments) {
    io::require_writable(arguments.out);
    const scenario::ExerciseFiles files = exercise_named(arguments.scenario);
    const scenario::Scenario scenario = scenario::load_scenario(files.file, catalogue());
    const script::CommandScript script =
        script_for(files, arguments.commands).value_or(script::parse_commands("0 end\n", "no script"));
    require_no_input({{"--out", arguments.out}}, scenario, {script.file});
    run::RunOptions options;
    options.images = false;
    options.cache.folder = usual_cache(arguments.cache);
    options.interrupted = stop_requested;
    std::optional<anatomy::Anatomy> anatomy;
    geometry::Polyline tip;
    std::vector<anatomy::Trail> devices;
    run::RunResult result;
    {
        ProgressBar bar;
        report_on(bar, options.cache);
        options.observer = [&](const exercise::Frame& frame, exercise::Exercise& exercise) {
            const exercise::Simulation& simulation = exercise.simulation();
            if (!anatomy) {
                anatomy = simulation.anatomy();
                if (scenario.target.name.empty())
                    anatomy->targets.assign(1, {"target", simulation.target(), 0, 0});
                else
                    std::erase_if(anatomy->targets,
                                  [&](const auto& target) { return target.name != scenario.target.name; });
            }
            if (frame.motion.reset) tip.clear();
            tip.push_back(simulation.tip());
            constexpr const char* colours[] = {"#000000", "#d55e00", "#56b4e9", "#cc79a7", "#8a5a00"};
            devices.clear();
            for (const scenario::PlacedDevice& placed : simulation.devices()) {
                const auto k = devices.size();
                devices.push_back({std::string(placed.name()) + (k == 0 ? " at the end" : ""),
                                   simulation.path_of(placed.role), colours[k],
                                   1.6 + 0.8 * static_cast<double>(k)});
            }
        };
        result = run::run_headless(scenario, script, options);
    }
    if (result.interrupted) return interrupted;
    anatomy->name = scenario.title;
    std::vector<anatomy::Trail> trails = devices;
    std::erase_if(trails, [](const anatomy::Trail& trail) { return trail.points.empty(); });
    trails.push_back({"way of the tip", tip, "#d00000", 1.2});
    anatomy::draw_anatomy(*anatomy, arguments.out, trails);
    print("{}: {} frames, {}\n", arguments.out, result.frames,
          result.score.completed ? "target reached" : "target not reached");
    return done;
}

}  // namespace

Command add_show(CLI::App& parser) {
    const auto arguments = std::make_shared<ShowArguments>();
    CLI::App* command = parser.add_subcommand(
        "show",
        "A picture of a scenario's vessels with their names, and the way that its wire takes\n\n"
        "Examples:\n"
        "  seldinger show renal --out renal.png                            with the way of its solution\n"
        "  seldinger show renal --commands my/run.gw --out mine.png        with yours");
    add_scenario(command, arguments->scenario);
    add_script(command, arguments->commands, "the exercise's solution, if any");
    command->add_option("--out", arguments->out, "File for the picture (.png)")
        ->required()
        ->type_name("FILE")
        ->check(picture_name());
    add_cache_folder(command, arguments->cache);
    command->footer("Exit codes: 0 done, 2 bad input, 130 interrupted.");
    return {command, [arguments] { return show(*arguments); }};
}

}  // namespace app
