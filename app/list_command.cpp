/// `seldinger list`: the exercises, and what there is to know of one scenario.

#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <numeric>

#include "app/command.h"
#include "app/json.h"
#include "app/progress_bar.h"
#include "engine/anatomy/anatomy.h"
#include "engine/exercise/grade.h"
#include "engine/scenario/device.h"
#include "engine/scenario/model_choice.h"
#include "engine/scenario/placement.h"
#include "engine/scenario/scenario.h"
#include "physics/geometry/polyline.h"
#include "physics/geometry/vec.h"

namespace app {
namespace {

std::string figure(const std::optional<double>& value, const char* unit) {
    return value ? fmt::format("{:g} {}", *value, unit) : std::string("-");
}

void list_devices(bool json) {
    Json devices = Json::array();
    for (const std::filesystem::path& file : scenario::device_files(catalogue())) {
        const scenario::Device device = scenario::load_device(file);
        if (json)
            devices.push_back({{"name", device.name},
                               {"kind", scenario::name_of(device.kind)},
                               {"title", device.title},
                               {"file", file.string()}});
        else
            print("{:<16} {:<9} {}\n", device.name, scenario::name_of(device.kind), device.title);
    }
    if (json) print_json({{"schema", 1}, {"devices", devices}});
}

std::string skilled_time(const scenario::Benchmark& skilled) {
    return skilled.completed_after.given() ? fmt::format("{:.0f} s", skilled.completed_after.mean()) : "-";
}

/// A file, or null where there is none.
Json of_file(const std::filesystem::path& file) {
    return file.empty() ? Json(nullptr) : Json(file.string());
}

Json of_level(const scenario::Lesson& lesson) {
    return lesson.level > 0 ? Json(lesson.level) : Json(nullptr);
}

void list_scenarios(const std::vector<scenario::ExerciseFiles>& files, bool json) {
    const std::vector<LoadedExercise> all = loaded(files);
    if (json) {
        Json exercises = Json::array();
        for (const auto& [of, s] : all) {
            const scenario::Sample& time = s.lesson.benchmark.completed_after;
            exercises.push_back({{"name", s.name},
                                 {"title", s.title},
                                 {"level", of_level(s.lesson)},
                                 {"skilled_s", time.given() ? Json(time.mean()) : Json(nullptr)},
                                 {"file", of.file.string()},
                                 {"solution", of_file(of.solution)},
                                 {"picture", of_file(of.picture)}});
        }
        return print_json({{"schema", 1}, {"exercises", exercises}});
    }
    std::size_t widest = 4;
    for (const LoadedExercise& one : all) widest = std::max(widest, one.files.name.size());
    print("{:<{}}  level  skilled  solution  exercise\n", "name", widest);
    for (const auto& [of, s] : all)
        print("{:<{}}  {:>5}  {:>7}  {:<8}  {}\n", s.name, widest,
              s.lesson.level > 0 ? std::to_string(s.lesson.level) : "-", skilled_time(s.lesson.benchmark),
              of.solution.empty() ? "-" : "yes", s.title);
}

double mean_radius(const geometry::CentrelineBranch& branch) {
    return std::accumulate(branch.radii.begin(), branch.radii.end(), 0.0) /
           static_cast<double>(branch.radii.size());
}

/// How long and wide a branch is, and where it leaves its parent.
std::string text_of(const anatomy::Anatomy& anatomy, const geometry::CentrelineBranch& branch) {
    const auto [least, most] = std::minmax_element(branch.radii.begin(), branch.radii.end());
    const double mean = mean_radius(branch);
    std::string text = fmt::format("{:<28} {:.0f} mm long, radius {:.1f} to {:.1f} mm, {:.1f} on average",
                                   branch.name, geometry::length_of(branch.points), *least, *most, mean);
    if (branch.parent >= 0)
        text += fmt::format(", leaves {} at {:.0f} mm", anatomy.branches[branch.parent].name,
                            anatomy::along(anatomy, {branch.parent, branch.parent_sample}));
    return text;
}

Json of_place(const geometry::Vec3& place) {
    return {place.x(), place.y(), place.z()};
}

Json of_vessels(const scenario::Scenario& s, const anatomy::Anatomy& anatomy) {
    Json ends = Json::array(), branches = Json::array(), parts = Json::array(), targets = Json::array();
    for (const anatomy::VesselEnd& end : anatomy.ends)
        ends.push_back({{"name", end.opening.name}, {"radius_mm", end.opening.radius}});
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        const auto [least, most] = std::minmax_element(branch.radii.begin(), branch.radii.end());
        Json one = {{"name", branch.name},        {"length_mm", geometry::length_of(branch.points)},
                    {"least_radius_mm", *least},  {"mean_radius_mm", mean_radius(branch)},
                    {"largest_radius_mm", *most}, {"leaves", nullptr},
                    {"leaves_at_mm", nullptr}};
        if (branch.parent >= 0) {
            one["leaves"] = anatomy.branches[branch.parent].name;
            one["leaves_at_mm"] = anatomy::along(anatomy, {branch.parent, branch.parent_sample});
        }
        branches.push_back(std::move(one));
    }
    if (s.vessels)
        for (const anatomy::PartPlace& part : anatomy::parts_of(*s.vessels))
            parts.push_back({{"name", part.name},
                             {"branch", part.branch},
                             {"start_mm", part.start},
                             {"end_mm", part.end}});
    for (const anatomy::VesselTarget& target : anatomy.targets)
        targets.push_back({{"name", target.name},
                           {"branch", anatomy.branches[target.branch].name},
                           {"place_mm", of_place(target.centre)}});
    return {{"ends", ends}, {"branches", branches}, {"parts", parts}, {"targets", targets}};
}

Json of_scenario(const scenario::Scenario& s, const std::filesystem::path& file,
                 const anatomy::Anatomy& anatomy, const std::string& refused) {
    const scenario::Lesson& lesson = s.lesson;
    Json devices = Json::array(), views = Json::array(), patients = Json::array(), steps = Json::array();
    for (const scenario::PlacedDevice& placed : s.devices) {
        const scenario::Device& d = placed.device;
        devices.push_back({{"place", placed.name()},
                           {"name", d.name},
                           {"title", d.title},
                           {"diameter_mm", d.outer_diameter},
                           {"length_mm", d.length},
                           {"inserted_mm", placed.inserted},
                           {"shaft_rigidity_N_mm2", d.shaft_rigidity()},
                           {"tip_rigidity_N_mm2", physics::rigidity_at(d, 0)},
                           {"friction", d.friction}});
    }
    for (const scenario::SuggestedView& view : lesson.views)
        views.push_back({{"lao_deg", view.lao / geometry::degree},
                         {"cranial_deg", view.cranial / geometry::degree},
                         {"shows", view.shows}});
    for (std::size_t k = 0; k < lesson.patients.size(); ++k)
        patients.push_back({{"number", k + 2},
                            {"who", lesson.patients[k].who},
                            {"indication", lesson.patients[k].indication}});
    for (const scenario::LessonStep& step : lesson.steps) steps.push_back(step.text);
    Json json = {{"schema", 1},
                 {"name", s.name},
                 {"title", s.title},
                 {"file", file.string()},
                 {"refused", refused.empty() ? Json(nullptr) : Json(refused)},
                 {"level", of_level(lesson)},
                 {"briefing", lesson.briefing},
                 {"target",
                  {{"name", s.target.name},
                   {"radius_mm", s.target.radius},
                   {"hold_s", s.target.hold},
                   {"by", script::name_of(s.target.device)}}},
                 {"start", s.entry.end},
                 {"devices", devices},
                 {"wall_stiffness_N_per_mm", s.wall_stiffness},
                 {"time_limit_s", or_null(s.time_limit)},
                 {"beam_limit_s", or_null(s.beam_limit)},
                 {"contrast_limit_ml", s.blood.limit},
                 {"skilled", nullptr},
                 {"views", views},
                 {"hints", lesson.hints},
                 {"patients", patients},
                 {"steps", steps}};
    if (const scenario::Benchmark& skilled = lesson.benchmark; skilled.given()) {
        Json means = Json::object();
        for (const exercise::GradeLine& line : exercise::grade({}, skilled).lines)
            if (line.mean) means[line.measure->id] = *line.mean;
        json["skilled"] = {{"by", skilled.by}, {"attempts", skilled.attempts}, {"means", means}};
    }
    json.update(of_vessels(s, anatomy));
    return json;
}

void show_scenario(const ScenarioChoice& what, const std::string& cache_folder, bool json) {
    const std::filesystem::path file = exercise_named(what).file;
    const scenario::Scenario s = load_exercise(file, {}, what.patient);
    anatomy::ModelCache cache;
    cache.folder = usual_cache(cache_folder);
    const anatomy::Anatomy anatomy = [&] {
        ProgressBar bar;
        report_on(bar, cache);
        return scenario::anatomy_of(s, cache);
    }();
    std::string refused;
    try {
        scenario::entry_of(s, anatomy);
        scenario::target_of(s, anatomy);
    } catch (const io::InputError& error) {
        refused = error.what();
        tell("note: it would be refused: {}\n", refused);
    }
    if (json) return print_json(of_scenario(s, file, anatomy, refused));
    const auto line = [](const char* name, const std::string& text) { print("{:<11} {}\n", name, text); };
    print("{}: {}\n", s.name, s.title);
    if (!s.lesson.briefing.empty()) print("\n{}\n\n", s.lesson.briefing);
    if (s.lesson.level > 0) line("level", fmt::format("{} of {}", s.lesson.level, scenario::Lesson::levels));
    line("target", fmt::format("{}, within {:g} mm for {:g} s, by the {}",
                               s.target.name.empty() ? "a place of its own" : s.target.name, s.target.radius,
                               s.target.hold, script::name_of(s.target.device)));
    line("start", s.entry.end);
    for (const scenario::PlacedDevice& placed : s.devices) {
        const scenario::Device& d = placed.device;
        line(std::string(placed.name()).c_str(),
             fmt::format(
                 "{}: {:g} mm thick, {:g} mm long, {:g} mm inside, EI {:g} to {:g} N mm2, friction {:g}",
                 d.title, d.outer_diameter, d.length, placed.inserted, d.shaft_rigidity(),
                 physics::rigidity_at(d, 0), d.friction));
    }
    line("wall", fmt::format("{:g} N/mm a joint{}", s.wall_stiffness,
                             s.wall_variation ? fmt::format(", up to {:.0f} % more or less along the vessels",
                                                            100 * s.wall_variation->sum())
                                              : ""));
    line("limits", fmt::format("time {}, beam {}, contrast {:.0f} ml", figure(s.time_limit, "s"),
                               figure(s.beam_limit, "s"), s.blood.limit));
    if (const scenario::Benchmark& skilled = s.lesson.benchmark; skilled.given()) {
        line("skilled", fmt::format("{} attempts by {}", skilled.attempts, skilled.by));
        for (const exercise::GradeLine& of : exercise::grade({}, skilled).lines)
            if (of.mean) line("", fmt::format("{:<32} {}", of.measure->name, exercise::skilled_text(of)));
    }
    for (const scenario::SuggestedView& view : s.lesson.views)
        line("look",
             fmt::format("{} {:.0f}, {} {:.0f}: {}", view.lao < 0 ? "RAO" : "LAO",
                         std::abs(view.lao) / geometry::degree, view.cranial < 0 ? "caudal" : "cranial",
                         std::abs(view.cranial) / geometry::degree, view.shows));
    for (const std::string& hint : s.lesson.hints) line("hint", hint);
    for (std::size_t k = 0; k < s.lesson.patients.size(); ++k)
        line("patient", fmt::format("{}: {}{}{}", k + 2, s.lesson.patients[k].who,
                                    s.lesson.patients[k].indication.empty() ? "" : ": ",
                                    s.lesson.patients[k].indication));
    for (const scenario::LessonStep& step : s.lesson.steps) line("step", step.text);
    for (const anatomy::VesselEnd& end : anatomy.ends)
        line("end", fmt::format("{:<28} radius {:.1f} mm", end.opening.name, end.opening.radius));
    for (const geometry::CentrelineBranch& branch : anatomy.branches)
        line("branch", text_of(anatomy, branch));
    if (s.vessels)
        for (const anatomy::PartPlace& part : anatomy::parts_of(*s.vessels))
            line("part",
                 fmt::format("{:<28} of {}, {:.0f} to {:.0f} mm along it; its own at_mm is 0 to {:.0f}",
                             part.name, part.branch, part.start, part.end, part.end - part.start));
    for (const anatomy::VesselTarget& target : anatomy.targets)
        line("target at",
             fmt::format("{:<28} {:.1f}, {:.1f}, {:.1f} mm, in {}", target.name, target.centre.x(),
                         target.centre.y(), target.centre.z(), anatomy.branches[target.branch].name));
}

}  // namespace

Command add_list(CLI::App& parser) {
    struct Arguments {
        ScenarioChoice what{"scenarios", {}};
        std::string cache;
        bool json = false;
    };
    const auto arguments = std::make_shared<Arguments>();
    CLI::App* command = parser.add_subcommand(
        "list",
        "List the exercises, or the devices, that there are, or describe one\n\n"
        "Examples:\n"
        "  seldinger list                   the exercises, by level\n"
        "  seldinger list devices           wires, catheters, balloons, stents of the catalogue\n"
        "  seldinger list renal             target, ends, branches, benchmark and hints of "
        "one scenario");
    command
        ->add_option("what", arguments->what.named,
                     "'scenarios', 'devices', a folder of exercises, or one: a file (.toml), or its name")
        ->type_name("SCENARIO");
    add_exercises(command, arguments->what.exercises);
    add_json(command, arguments->json);
    add_cache_folder(command, arguments->cache);
    command->footer("Exit codes: 0 done, 2 bad input.");
    return {command, [arguments] {
                const ScenarioChoice& what = arguments->what;
                std::error_code ignored;
                if (what.named == "devices")
                    list_devices(arguments->json);
                else if (what.named == "scenarios")
                    list_scenarios(exercise_folders(what.exercises).all(), arguments->json);
                else if (std::filesystem::is_directory(what.named, ignored))
                    list_scenarios(exercise_folders().in(what.named), arguments->json);
                else
                    show_scenario(what, arguments->cache, arguments->json);
                return done;
            }};
}

}  // namespace app
