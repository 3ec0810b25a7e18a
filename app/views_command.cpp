/// `seldinger views`: which angles of the C-arm show a stretch of the vessels.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/json.h"
#include "app/progress_bar.h"
#include "engine/exercise/branch_stretch.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/plan/view_pictures.h"
#include "engine/plan/views.h"
#include "engine/run/picture_file.h"
#include "engine/scenario/placement.h"

namespace app {
namespace {

struct ViewsArguments {
    ScenarioChoice scenario;
    std::string branch, side, contrast, out, cache;
    std::optional<double> from, to;  // [mm]
    double step = 5, apart = 20;     // [deg]
    bool json = false, no_pictures = false, way = false;
};

double degrees(double angle) {
    return std::round(angle / geometry::degree * 1e3) / 1e3;
}

Json json_of(const plan::ViewAngles& angles, const plan::ViewFigures& figures, bool ostium) {
    const auto rounded = [](double value) { return std::round(value * 1e6) / 1e6; };
    return {{"view", plan::text_of(angles)},
            {"lao_deg", degrees(angles.lao)},
            {"cranial_deg", degrees(angles.cranial)},
            {"foreshortening", rounded(figures.foreshortening)},
            {"overlap", rounded(figures.overlap)},
            {"ostium_deg", ostium ? Json(degrees(figures.ostium)) : Json(nullptr)},
            {"cost", rounded(figures.cost)}};
}

Json json_of(const plan::ViewTarget& target, const anatomy::Anatomy& anatomy,
             const std::vector<plan::BestView>& best, const plan::ViewMap& map) {
    Json stretches = Json::array(), views = Json::array();
    for (const plan::ViewStretch& one : target.stretches)
        stretches.push_back({{"branch", anatomy.branches[static_cast<std::size_t>(one.branch)].name},
                             {"from_mm", std::round(one.from * 1e3) / 1e3},
                             {"to_mm", std::round(one.to * 1e3) / 1e3}});
    for (const plan::BestView& view : best) {
        views.push_back(json_of(view.angles, view.figures, target.ostium.has_value()));
        views.back()["least_cost"] = json_of(view.lowest, view.figures_of_lowest, target.ostium.has_value());
    }
    Json left_out = Json::object();
    for (const plan::Blocked blocked :
         {plan::Blocked::BeyondRange, plan::Blocked::Table, plan::Blocked::Patient})
        left_out[std::string(plan::text_of(blocked))] =
            std::count(map.blocked.begin(), map.blocked.end(), blocked);
    return {{"target", target.name}, {"stretches", stretches},       {"ostium", target.ostium.has_value()},
            {"best", views},         {"angles", map.figures.size()}, {"left_out", left_out}};
}

/// Where contrast comes in: the branch that is named, the flush catheter's, or −1: everywhere.
int contrast_of(const ViewsArguments& arguments, const scenario::Scenario& scenario,
                const anatomy::Anatomy& anatomy) {
    const std::string& named =
        arguments.contrast.empty() ? scenario.entry.flush_catheter : arguments.contrast;
    if (named.empty()) return -1;
    const std::optional<int> branch = anatomy::branch_named(anatomy, named);
    if (!branch) throw io::InputError("--contrast: {}", exercise::unknown_branch(named, anatomy));
    return *branch;
}

std::vector<plan::ViewTarget> targets_of(const ViewsArguments& arguments, const scenario::Scenario& scenario,
                                         const anatomy::Anatomy& anatomy) {
    if (!arguments.branch.empty()) {
        if (!arguments.from || !arguments.to)
            throw BadArgument("--branch: expected --from-mm and --to-mm with it, found {}",
                              arguments.from ? "--from-mm alone"
                              : arguments.to ? "--to-mm alone"
                                             : "neither");
        return {plan::view_target(anatomy, arguments.branch, *arguments.from, *arguments.to, arguments.side)};
    }
    if (arguments.from || arguments.to || !arguments.side.empty())
        throw BadArgument("{}: expected --branch with it, found none", arguments.from ? "--from-mm"
                                                                       : arguments.to ? "--to-mm"
                                                                                      : "--side");
    const geometry::Vec3 target = scenario::target_of(scenario, anatomy);
    if (!arguments.way) return {plan::view_target_at(anatomy, target)};
    const std::optional<int> end = anatomy::find_end(anatomy, scenario.entry.end);
    if (!end) throw io::InputError("--way: expected vessels with ends by name, found a tube");
    const auto on_way = plan::view_targets_on_way(
        anatomy, anatomy.ends[static_cast<std::size_t>(*end)].opening.centre, target);
    if (on_way.empty())
        throw io::InputError("--way: expected a target more than a few millimetres from '{}', found it there",
                             scenario.entry.end);
    return on_way;
}

int views(const ViewsArguments& arguments) {
    const scenario::Scenario scenario = scenario_named(arguments.scenario);
    const std::filesystem::path folder = arguments.out;
    std::optional<io::OwnFolder> own;
    if (!arguments.out.empty()) {
        require_no_input({{"--out", folder / "views.csv"}}, scenario);
        own.emplace(folder);
    }
    anatomy::ModelCache cache;
    cache.folder = usual_cache(arguments.cache);
    Json steps = Json::array();
    std::string said;
    {
        ProgressBar bar;
        report_on(bar, cache);
        const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario, cache);
        const std::vector<plan::ViewTarget> targets = targets_of(arguments, scenario, anatomy);
        const std::vector<bool> filled =
            plan::filled_from(anatomy, contrast_of(arguments, scenario, anatomy));
        const plan::Stand stand = plan::stand_of(scenario, anatomy, cache);
        for (std::size_t k = 0; k < targets.size(); ++k) {
            const plan::ViewedTarget target(anatomy, targets[k], filled);
            const plan::ViewMap map = plan::view_map(target, stand, arguments.step);
            const auto best = plan::best_views(map, 3, arguments.apart * geometry::degree);
            steps.push_back(json_of(targets[k], anatomy, best, map));
            said += fmt::format("{}{}\n  view                foreshortened  covered{}  cost\n",
                                targets[k].name, targets[k].ostium ? ", and its ostium" : "",
                                targets[k].ostium ? "  ostium off profile" : "");
            for (const plan::BestView& view : best)
                said += fmt::format(
                    "  {:<18} {:>12.1f} % {:>6.1f} %{}  {:.3f}\n", plan::text_of(view.angles),
                    100 * view.figures.foreshortening, 100 * view.figures.overlap,
                    targets[k].ostium ? fmt::format("  {:>14.1f} deg", view.figures.ostium / geometry::degree)
                                      : "",
                    view.figures.cost);
            const auto blocked =
                map.blocked.size() - static_cast<std::size_t>(std::count(
                                         map.blocked.begin(), map.blocked.end(), plan::Blocked::Free));
            if (blocked > 0)
                said += fmt::format(
                    "  left out: {} of {} angles, where detector or tube would meet table or "
                    "patient\n",
                    blocked, map.blocked.size());
            if (!own) continue;
            const std::string name = targets.size() > 1 ? fmt::format("views_{}", k + 1) : "views";
            io::write_whole(folder / (name + ".csv"), plan::to_csv(map));
            if (const std::string why = plan::write_map_picture(map, best, targets[k], folder, name);
                !why.empty())
                tell("note: {}\n", why);
            if (arguments.no_pictures) continue;
            const auto pictures = plan::view_pictures(scenario, target, filled, best, cache);
            for (std::size_t i = 0; i < pictures.size(); ++i)
                run::write_picture(folder / fmt::format("{}_best_{}.png", name, i + 1), pictures[i]);
        }
    }
    const Json document = {{"schema", 1}, {"scenario", scenario.name}, {"steps", steps}};
    if (own) {
        io::write_whole(folder / "views.json",
                        document.dump(2, ' ', true, Json::error_handler_t::replace) + "\n");
        own->keep();
    }
    if (arguments.json)
        print_json(document);
    else
        print("{}", said);
    return done;
}

}  // namespace

Command add_views(CLI::App& parser) {
    const auto arguments = std::make_shared<ViewsArguments>();
    CLI::App* command = parser.add_subcommand(
        "views",
        "Angles of the C-arm that show a stretch of the vessels: map, best three, pictures\n\n"
        "Examples:\n"
        "  seldinger views renal --out views\n"
        "  seldinger views coronary_right --branch RCA --from-mm 100 --to-mm 120 --side PDA");
    add_scenario(command, arguments->scenario);
    add_patient(command, arguments->scenario);
    command
        ->add_option(
            "--branch", arguments->branch,
            "Vessel to show, with --from-mm and --to-mm; else the last part of the way to the target")
        ->type_name("NAME");
    add_optional(command, "--from-mm", arguments->from,
                 "Where the stretch begins, from the branch's origin [mm]")
        ->check(number());
    add_optional(command, "--to-mm", arguments->to, "Where it ends [mm]")->check(number());
    command
        ->add_option("--side", arguments->side,
                     "Branch whose first 10 mm have to be seen too, and free: a bifurcation")
        ->type_name("NAME");
    command->add_flag("--way", arguments->way, "Every part of the way to the target, each by itself");
    command
        ->add_option("--contrast", arguments->contrast,
                     "Branch at whose origin contrast comes in, which fills it and all that leave it; else "
                     "that of the flush catheter, else all vessels are filled")
        ->type_name("NAME");
    command->add_option("--step-deg", arguments->step, "Between angles of the map [deg]")
        ->check(number(1, 30));
    command->add_option("--apart-deg", arguments->apart, "Between the best views at least [deg]")
        ->check(number(1, 90));
    command
        ->add_option("--out", arguments->out,
                     "Folder for views.csv, views.json, the map's picture and angiograms of the best views")
        ->type_name("FOLDER");
    command->add_flag("--no-pictures", arguments->no_pictures, "Without angiograms, which takes less time");
    add_json(command, arguments->json);
    add_cache_folder(command, arguments->cache);
    command->footer("Exit codes: 0 done, 2 bad input.");
    return {command, [arguments] { return views(*arguments); }};
}

}  // namespace app
