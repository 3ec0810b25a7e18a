#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <memory>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/scenes.h"
#include "engine/io/cpu_clock.h"
#include "engine/scenario/model_choice.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/refinement.h"

namespace studies {
namespace {

/// A wire pushed from `start` to `end` [mm] into a vessel. Wall stiffness is per length of wire.
struct Case {
    std::string name;
    anatomy::Anatomy anatomy;
    geometry::Polyline path;
    scenario::Device wire;
    std::optional<double> radius;  // of a tube in closed form [mm]
    double stiffness = 0;          // k over λ [N/mm²]
    double start = 20, end = 0;    // inserted length [mm]
};

Case tube_case(const std::string& name, const geometry::Polyline& path, double radius, double stiffness,
               const scenario::Device& wire, double end) {
    return {name, anatomy::tube_anatomy(name, path, radius, 16, radius), path, wire, radius, stiffness, 20,
            end};
}

Case paper_case(const char* name, double fraction) {
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    scenario::Device wire;
    wire.outer_diameter = 0.1;
    wire.sections = {{0, scene.rigidity, scene.rigidity}};
    return tube_case(name, anatomy::draw(scene.path), scene.radius,
                     scene.wall_stiffness / scene.segment_length, wire,
                     fraction * scene.segments * scene.segment_length);
}

/// A hydrophilic wire of 0.035 in without friction, its torsion rigid.
scenario::Device frictionless_glide(const StudyOptions& options) {
    scenario::Device wire = scenario::load_device(scenario::find_device("glide035", options.devices));
    wire.friction = wire.buckling_force = 0;
    physics::stiffen(wire);
    return wire;
}

Case long_case(const StudyOptions& options) {
    const Vec3 y = Vec3::UnitY(), z = Vec3::UnitZ();
    const std::vector<anatomy::PenMove> path = {anatomy::Run{350}, anatomy::Arc{40, 0.8, z},
                                                anatomy::Run{250}, anatomy::Arc{25, -1.4, y},
                                                anatomy::Run{150}};
    return tube_case("long tube", anatomy::draw(path), 4, 2.5, frictionless_glide(options), 780);
}

Case iliac_case(const StudyOptions& options) {
    Case c;
    c.name = "iliac to aorta";
    c.anatomy = anatomy::generated_anatomy(anatomy::vessel_preset("iliac-renal"), options.cache);
    c.path = anatomy::path_from(c.anatomy, *anatomy::find_end(c.anatomy, "RCIA+REIA+RCFA.out")).points;
    c.wire = frictionless_glide(options);
    c.stiffness = 2.5;
    c.start = 60;
    c.end = 312;
    return c;
}

std::vector<Case> cases(const StudyOptions& options) {
    if (options.quick) return {paper_case("hairpin", 0.6)};
    return {paper_case("sinuous", 1), paper_case("spatial", 1), paper_case("hairpin", 1), iliac_case(options),
            long_case(options)};
}

struct Variant {
    std::string_view name;
    double factor;  // of the chosen λ
    bool adaptive;
};
constexpr std::array<Variant, 4> variants = {{{"uniform λ/2", 0.5, false},
                                              {"adaptive from λ/2", 0.5, true},
                                              {"uniform λ", 1, false},
                                              {"adaptive from λ", 1, true}}};  // each after its uniform one
constexpr int reference_course = 0, uniform_course = 2, chosen_course = 3;

/// The wire after every push of one chosen λ, and what the pushes cost.
struct EconomyCourse {
    std::vector<Chain> wires;
    double relaxing = 0, refining = 0;  // [s]
    double slowest = 0;                 // push of one segment, including refining [s]
    double pushed = 0;                  // [mm]
    long long newton_steps = 0;
    int pushes = 0, unconverged = 0;
    int segments() const { return wires.back().segments(); }
};

EconomyCourse push(const Case& c, const physics::LumenWall& wall, const Variant& variant, double lambda) {
    const int every = static_cast<int>(std::lround(1 / variant.factor));
    physics::RelaxerConfig config;
    config.kind = physics::RelaxerKind::Global;
    const auto relaxer = physics::make_relaxer(config, wall);
    const physics::RelaxBudget unlimited{1'000'000'000, 0, 0};
    Chain wire = physics::wire_along(c.wire, {variant.factor * lambda}, c.path,
                                     every * static_cast<int>(std::lround(c.start / lambda)));
    relaxer->relax(wire, unlimited);
    EconomyCourse course;
    while (wire.inserted_length() + lambda <= c.end + 1e-6) {
        for (int k = 0; k < every; ++k) {
            const double begin = io::thread_cpu_seconds();
            if (variant.adaptive) physics::refine(wire, wall);
            const double refined = io::thread_cpu_seconds();
            physics::move(wire, wire.grid.segment_length);
            const auto report = relaxer->relax(wire, unlimited);
            const double end = io::thread_cpu_seconds();
            course.refining += refined - begin;
            course.relaxing += end - refined;
            course.slowest = std::max(course.slowest, end - begin);
            course.newton_steps += report.newton_steps;
            course.unconverged += !report.converged();
            ++course.pushes;
        }
        course.pushed += lambda;
        course.wires.push_back(wire);
    }
    return course;
}

double distance_to(const Chain& wire, const Vec3& x) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 1; i <= wire.segments(); ++i) {
        const Vec3 from = x - wire.joints[i - 1];
        const double along = std::clamp(from.dot(wire.tangents[i]), 0.0, wire.lengths[i]);
        nearest = std::min(nearest, (from - along * wire.tangents[i]).norm());
    }
    return nearest;
}

/// Distance of the reference's farthest joint from the wire's curve, after each push [mm].
std::vector<double> deviations(const EconomyCourse& reference, const EconomyCourse& course) {
    std::vector<double> farthest(course.wires.size(), 0.0);
    for (std::size_t k = 0; k < course.wires.size(); ++k)
        for (const Vec3& x : reference.wires[k].joints)
            farthest[k] = std::max(farthest[k], distance_to(course.wires[k], x));
    return farthest;
}

std::unique_ptr<const physics::LumenWall> wall_of(const Case& c, scenario::WallModel model,
                                                  double stiffness) {
    const double wire_radius = 0.5 * c.wire.outer_diameter;
    if (model == scenario::WallModel::Analytic)
        return std::make_unique<physics::TubeWall>(c.path, *c.radius, stiffness, wire_radius);
    if (model == scenario::WallModel::Mesh)
        return std::make_unique<physics::MeshWall>(c.anatomy.lumen, c.anatomy.branches, c.anatomy.openings(),
                                                   stiffness, wire_radius);
    return anatomy::cached_distance_field(c.anatomy, stiffness, wire_radius, {});
}

std::string_view word(scenario::WallModel model) {
    return model == scenario::WallModel::Analytic ? "analytic"
           : model == scenario::WallModel::Mesh   ? "mesh"
                                                  : "distance field";
}

/// The variants of one scene side by side: a panel for each figure, and one for the key.
io::Plot bars(const std::vector<Case>& list) {
    struct Panel {
        int column;
        std::string_view title;
        std::size_t first;  // first variant: the reference has no deviation
    };
    constexpr std::array<Panel, 3> panels = {{{7, "segments at the end", 0},
                                              {8, "processor time a mm of push [ms]", 0},
                                              {12, "median deviation from uniform λ/2 [mm]", 1}}};
    constexpr std::array<std::string_view, 4> colours = {"#999999", "#56B4E9", "#E69F00", "#009E73"};
    std::string tics, keys, scenes;
    TemplateRows all;
    for (std::size_t r = 0; r < list.size(); ++r) {
        const Case& c = list[r];
        tics += fmt::format("{}'{}' {}", r > 0 ? ", " : "", c.name, 5 * r + 1.5);
        scenes +=
            fmt::format(" {}: EI = {:g} N·mm² (tip {:g}), k = {:g} N/mm a mm of wire, pushed to {:g} mm.",
                        c.name, c.wire.shaft_rigidity(), physics::rigidity_at(c.wire, 0), c.stiffness, c.end);
    }
    for (const Panel& panel : panels) {
        const auto bar = [&](std::size_t k) -> TemplateValues {
            return {{"variant", panel.first + k}, {"colour", colours[panel.first + k]}};
        };
        all.push_back({{"title", panel.title},
                       {"column", panel.column},
                       {"bars", rows_of(variants.size() - panel.first, bar)}});
    }
    for (std::size_t v = 0; v < variants.size(); ++v)
        keys += fmt::format("{}-1 with boxes lc rgb '{}' title '{}'", v > 0 ? ", " : "", colours[v],
                            variants[v].name);
    return filled_plot("economy", 1700, 480,
                       {{"tics", tics},
                        {"right", 5 * list.size() - 1},
                        {"panels", all},
                        {"keys", keys},
                        {"scenes", scenes}});
}

}  // namespace

StudyResult run_economy(const StudyOptions& options) {
    const std::vector<Case> list = cases(options);
    const double tolerance = physics::RefinementOptions{}.curve_tolerance;
    io::Table all{
        "economy",
        {"row", "column", "scene", "variant", "wall", "segment_length_mm", "segments", "cpu_ms_per_mm",
         "refining_ms_per_mm", "slowest_push_ms", "newton_steps_per_push", "median_deviation_mm",
         "largest_deviation_mm", "median_change_mm", "largest_change_mm", "unconverged"}};
    io::Table numbers{"economy_figures", {all.columns.begin() + 2, all.columns.end()}};
    io::Table chosen{"economy_choice",
                     {"scene", "λ [mm]", "because", "wall", "since", "segments saved", "time saved",
                      "median / largest deviation [mm]", "median / largest change [mm]"}};
    const auto spread = [](const std::vector<double>& values) {
        return fmt::format("{:.2g} / {:.2g}", quantile(values, 0.5), quantile(values, 1));
    };
    Work work(options, static_cast<int>(list.size() * variants.size()));
    for (std::size_t r = 0; r < list.size(); ++r) {
        const Case& c = list[r];
        const scenario::ModelChoice choice =
            scenario::choose_model(c.anatomy, c.wire, tolerance, c.radius.has_value());
        std::vector<EconomyCourse> courses;
        std::vector<std::vector<double>> off;
        for (const Variant& variant : variants) {
            const double lambda = variant.factor * choice.segment_length;
            const auto wall = wall_of(c, choice.wall, c.stiffness * lambda);
            courses.push_back(push(c, *wall, variant, choice.segment_length));
            off.push_back(deviations(courses.front(), courses.back()));
            const EconomyCourse& course = courses.back();
            const std::vector<double> change =
                deviations(variant.adaptive ? courses[courses.size() - 2] : course, course);
            std::vector<io::TableCell> row = {c.name,
                                              variant.name,
                                              word(choice.wall),
                                              lambda,
                                              course.segments(),
                                              1e3 * (course.relaxing + course.refining) / course.pushed,
                                              1e3 * course.refining / course.pushed,
                                              1e3 * course.slowest,
                                              static_cast<double>(course.newton_steps) / course.pushes,
                                              quantile(off.back(), 0.5),
                                              quantile(off.back(), 1),
                                              quantile(change, 0.5),
                                              quantile(change, 1),
                                              course.unconverged};
            numbers.add(row);
            row.insert(row.begin(),
                       {static_cast<double>(r), static_cast<double>(&variant - variants.data())});
            all.add(std::move(row));
            work.tell(fmt::format("{}, {}", c.name, variant.name));
        }
        const auto saved = [&](auto figure) {
            const double own = figure(courses[chosen_course]);
            return fmt::format("{:.0f} % ({:.0f} %)", 100 * (1 - own / figure(courses[reference_course])),
                               100 * (1 - own / figure(courses[uniform_course])));
        };
        chosen.add({c.name, choice.segment_length, choice.segment_reason, word(choice.wall),
                    choice.wall_reason,
                    saved([](const EconomyCourse& course) { return static_cast<double>(course.segments()); }),
                    saved([](const EconomyCourse& course) { return course.relaxing + course.refining; }),
                    spread(off[chosen_course]),
                    spread(deviations(courses[uniform_course], courses[chosen_course]))});
    }
    StudyResult result;
    result.page = filled_text("economy", {{"quick", options.quick ? " --quick" : ""},
                                          {"tolerance", tolerance},
                                          {"longest", physics::RefinementOptions{}.longest},
                                          {"chosen", io::to_markdown(chosen, 3)},
                                          {"figures", io::to_markdown(numbers, 3)}});
    result.tables = {std::move(all), std::move(chosen)};
    result.plots = {bars(list)};
    return result;
}

}  // namespace studies
