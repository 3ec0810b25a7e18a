/// `seldinger render`.

#include <algorithm>
#include <memory>
#include <string>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/run/picture_file.h"
#include "engine/run/still.h"
#include "render/xray/materials.h"

namespace app {
namespace {

struct RenderArguments {
    ScenarioChoice scenario;
    std::string commands, out, cache, mode = "live";
    int frame = 0;
    std::optional<double> lao, cranial;  // [deg]
    double iodine = 60;
};

int render_image(const RenderArguments& arguments) {
    run::check_still(arguments.out);
    const scenario::ExerciseFiles files = exercise_named(arguments.scenario);
    const scenario::Scenario scenario = scenario::load_scenario(files.file, catalogue());
    const script::CommandScript script =
        script_for(files, arguments.commands).value_or(script::CommandScript());
    require_no_input({{"--out", arguments.out}}, scenario, {script.file});
    run::StillRequest request;
    request.frame = arguments.frame;
    if (arguments.lao) request.lao = *arguments.lao * geometry::degree;
    if (arguments.cranial) request.cranial = *arguments.cranial * geometry::degree;
    request.mode = static_cast<script::ImagingMode>(
        std::find(script::imaging_modes.begin(), script::imaging_modes.end(), arguments.mode) -
        script::imaging_modes.begin());
    request.iodine = arguments.iodine;
    anatomy::ModelCache cache;
    cache.folder = arguments.cache.empty() ? anatomy::cache_beside(arguments.out).string() : arguments.cache;
    ProgressBar bar;
    report_on(bar, cache);
    run::write_picture(arguments.out, run::render_still(scenario, script, request, cache));
    return 0;
}

}  // namespace

Command add_render(CLI::App& parser) {
    const auto arguments = std::make_shared<RenderArguments>();
    CLI::App* command = parser.add_subcommand("render",
                                              "One image of a scenario, from any side\n\n"
                                              "Examples:\n"
                                              "  seldinger render renal --frame 60 --out frame.png\n"
                                              "  seldinger render coronary --lao 30 --cranial 20 --mode dsa "
                                              "--out dsa.png");
    add_scenario(command, arguments->scenario);
    add_script(command, arguments->commands, "the exercise's solution, if any");
    command->add_option("--frame", arguments->frame, "The frame to show; its script runs up to it")
        ->check(whole_number(0, script::largest_frame));
    add_optional(command, "--lao", arguments->lao, "Angle of the arm, RAO negative [deg]");
    add_optional(command, "--cranial", arguments->cranial, "Angle of the arm, caudal negative [deg]");
    command->add_option("--mode", arguments->mode, "How the image is shown")
        ->check(one_of(std::vector<std::string>(script::imaging_modes.begin(), script::imaging_modes.end())));
    command
        ->add_option("--iodine", arguments->iodine,
                     "DSA, roadmap and cine: fills the vessels where the script left no contrast [mg/ml]")
        ->check(number(1, render::largest_iodine));
    command->add_option("--out", arguments->out, "The image, a .png")
        ->required()
        ->type_name("FILE")
        ->check(picture_name());
    add_cache_folder(command, arguments->cache, "cache beside --out");
    return {command, [arguments] { return render_image(*arguments); }};
}

}  // namespace app
