/// What each simplification of the model costs in accuracy and saves in time, per exercise.

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <optional>

#include "engine/exercise/simulation.h"
#include "engine/io/cpu_clock.h"
#include "engine/scenario/placement.h"
#include "engine/studies/quantile.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/wire/torsion.h"

namespace studies {
namespace {

using geometry::degree;
using scenario::Scenario;
using scenario::TorsionModel;

/// One thing that is left out, or made finer. Errors are those against another model of this list.
struct Simplification {
    std::string_view name;
    void (*make)(Scenario&);
    int against;
};

void refine(Scenario& s, double factor) {
    s.segment_length *= factor;
    s.wall_stiffness *= factor;  // the same per length of wire
}
void all_on(Scenario& s) {
    s.torsion = TorsionModel::Segments;
    s.tissue.rigid = s.tube.has_value();  // in closed form, which knows no vessel that moves
}
void no_friction(Scenario& s) {
    for (scenario::PlacedDevice& placed : s.devices) {
        scenario::Device& d = placed.device;
        d.friction = d.static_friction = d.inner_friction = d.static_inner_friction = 0;
        d.valve_friction = d.static_valve_friction = 0;
    }
}

enum Model { Fine, Full, Auto, Rigid, Whole, Still, Frictionless, Coarse, Planes, model_count };
constexpr std::array<Simplification, model_count> models = {{
    {"all on at λ/2", [](Scenario& s) { all_on(s), refine(s, 0.5); }, Fine},
    {"all on", [](Scenario& s) { all_on(s); }, Fine},
    {"auto as shipped", [](Scenario&) {}, Full},
    {"rigid torsion", [](Scenario& s) { all_on(s), s.torsion = TorsionModel::Rigid; }, Full},
    {"torsion as a whole", [](Scenario& s) { all_on(s), s.torsion = TorsionModel::Compliant; }, Full},
    {"vessels that stay", [](Scenario& s) { all_on(s), s.tissue.rigid = true; }, Full},
    {"no friction", [](Scenario& s) { all_on(s), no_friction(s); }, Full},
    {"2λ", [](Scenario& s) { all_on(s), refine(s, 2); }, Full},
    {"wall of planes",
     [](Scenario& s) { all_on(s), s.wall_model = scenario::WallModel::Mesh, s.tissue.rigid = true; }, Full},
}};

/// The course of one model through one solution.
struct ModelCourse {
    std::vector<Vec3> tips;         // after each frame, of the device that the exercise is about [mm]
    std::vector<double> wound;      // of its shaft then: turn that has not reached the distal end [rad]
    std::vector<double> left_out;   // what `auto` would state then for this model's torsion [rad]
    double milliseconds = 0;        // processor time a frame
    double left_out_at_tip = 0;     // largest [mm]
    std::vector<double> moved;      // then: farthest that a vessel is pushed aside [mm]
    std::vector<double> give;       // and what is stated of it [mm]
    std::vector<bool> stay;         // and whether vessels stay
    int changes = 0, restless = 0;  // of shafts' models; frames not at rest
    std::string refused;            // why there is no course
};

ModelCourse play(const Scenario& shipped, const script::CommandScript& solution, const Simplification& model,
                 const StudyOptions& options) {
    ModelCourse course;
    Scenario s = shipped;
    model.make(s);
    s.budget.updates *= 20;  // no motion waits for time, so that frames are the same moments
    std::optional<exercise::Simulation> simulation;
    try {
        if (const auto wrong = scenario::problems(s); !wrong.empty()) throw io::InputError(wrong.front());
        simulation.emplace(s, options.cache);
    } catch (const io::InputError& error) {
        course.refused = error.what();
        return course;
    }
    const int last = options.quick ? 15 : solution.last_frame(10),
              device = *simulation->scenario().index_of(s.target.device);
    double seconds = 0;
    for (int frame = 0; frame <= last; ++frame) {
        const double begin = io::thread_cpu_seconds();
        for (const script::TimedCommand& timed : solution.at(frame)) simulation->apply(timed.command);
        const exercise::StepReport report = simulation->step();
        seconds += io::thread_cpu_seconds() - begin;
        course.tips.push_back(simulation->tip());
        course.wound.push_back(simulation->wire().devices[device].wound_up());
        course.restless += report.settling || !simulation->readings().at_rest;
        course.moved.push_back(simulation->farthest_vessel_move());
        course.give.push_back(simulation->vessel_give().most);
        course.stay.push_back(simulation->vessels_stay());
        const scenario::TorsionNeed need = simulation->torsion_need(device);
        const double left = need.left_out(simulation->torsion(device));
        course.left_out.push_back(left);
        course.left_out_at_tip = std::max(course.left_out_at_tip, need.at_tip(left));
    }
    course.changes = simulation->model_changes().count;
    course.milliseconds = 1e3 * seconds / (last + 1);
    return course;
}

struct TipError {
    double rms = 0, median = 0, most = 0;  // [mm]
    double fraction = 0;                   // of frames that are more than 5 mm off [-]
};
constexpr double elsewhere = 5;  // [mm]: in another place of the vessel, or another vessel

TipError between(const ModelCourse& one, const ModelCourse& other) {
    TipError error;
    std::vector<double> off;
    for (std::size_t k = 0; k < std::min(one.tips.size(), other.tips.size()); ++k)
        off.push_back((one.tips[k] - other.tips[k]).norm());
    for (const double e : off) {
        error.rms += e * e / static_cast<double>(off.size());
        error.most = std::max(error.most, e);
        error.fraction += (e > elsewhere) / static_cast<double>(off.size());
    }
    error.rms = std::sqrt(error.rms);
    if (!off.empty()) error.median = quantile(off, 0.5);
    return error;
}

/// What a model leaves out of a shaft's twist, against the one that has it.
struct LeftOut {
    double stated = 0, found = 0;  // largest in the course [rad]
    double fraction = 0;           // of frames in which no more is found than is stated [-]
};
LeftOut left_out(const ModelCourse& model, const ModelCourse& full) {
    LeftOut result;
    const std::size_t count = std::min(model.wound.size(), full.wound.size());
    for (std::size_t k = 0; k < count; ++k) {
        const double found = std::abs(full.wound[k] - model.wound[k]);
        result.stated = std::max(result.stated, model.left_out[k]);
        result.found = std::max(result.found, found);
        result.fraction += (found <= model.left_out[k] + 0.1 * degree) / static_cast<double>(count);
    }
    return result;
}

/// What `auto` states of vessels that stay, against how far the full model's are pushed aside then.
struct GiveLeftOut {
    double stated = 0, found = 0;  // largest in the frames in which they stay [mm]
    double stay = 0,
           within = 0;  // fraction of all frames; of those in which no more is found than stated [-]
    double most = 0;    // found in any frame [mm]
};
GiveLeftOut give_left_out(const ModelCourse& model, const ModelCourse& full) {
    GiveLeftOut result;
    const std::size_t count = std::min(model.stay.size(), full.moved.size());
    int stay = 0, within = 0;
    for (std::size_t k = 0; k < count; ++k) {
        result.most = std::max(result.most, full.moved[k]);
        if (!model.stay[k]) continue;
        ++stay;
        within += full.moved[k] <= model.give[k];
        result.stated = std::max(result.stated, model.give[k]);
        result.found = std::max(result.found, full.moved[k]);
    }
    result.stay = count > 0 ? stay / static_cast<double>(count) : 0;
    result.within = stay > 0 ? within / static_cast<double>(stay) : 1;
    return result;
}

io::Plot chart(std::size_t exercises) {
    constexpr std::array<std::string_view, model_count> colours = {
        "", "#000000", "#D55E00", "#0072B2", "#56B4E9", "#009E73", "#CC79A7", "#E69F00", "#999999"};
    constexpr std::array<int, model_count> marks = {0, 1, 7, 2, 4, 5, 6, 9, 8};
    const auto model = [&](std::size_t k) -> TemplateValues {
        const std::size_t m = Full + k;
        return {
            {"number", m}, {"row", k}, {"mark", marks[m]}, {"colour", colours[m]}, {"model", models[m].name}};
    };
    return filled_plot("models", 1250, 760,
                       {{"exercises", exercises}, {"models", rows_of(model_count - Full, model)}});
}

struct Played {
    std::string name;
    std::array<ModelCourse, model_count> courses;
};

io::Table figures(const std::vector<Played>& all) {
    io::Table table{
        "models",
        {"row", "model_number", "scenario", "model", "ms_per_frame", "rms_mm", "median_mm", "largest_mm",
         "frames_off_share", "time_of_all_on", "torsion_changes", "restless_frames"}};
    for (std::size_t r = 0; r < all.size(); ++r)
        for (int m = 0; m < model_count; ++m) {
            const ModelCourse& course = all[r].courses[m];
            if (!course.refused.empty()) continue;
            const TipError error = between(course, all[r].courses[models[m].against]);
            table.add({static_cast<double>(r), m, all[r].name, std::string(models[m].name),
                       course.milliseconds, error.rms, error.median, error.most, error.fraction,
                       course.milliseconds / all[r].courses[Full].milliseconds, course.changes,
                       course.restless});
        }
    return table;
}

io::Table medians(const io::Table& figures) {
    io::Table table{"models_median",
                    {"model", "rms [mm]", "largest [mm]", "exercises with frames off", "time of \"all on\""}};
    for (int m = Full; m < model_count; ++m) {
        std::vector<double> rms, most, time;
        int off = 0;
        for (std::size_t row = 0; row < figures.rows.size(); ++row) {
            if (figures.number(row, "model_number") != m) continue;
            rms.push_back(figures.number(row, "rms_mm"));
            most.push_back(figures.number(row, "largest_mm"));
            time.push_back(figures.number(row, "time_of_all_on"));
            off += figures.number(row, "frames_off_share") > 0;
        }
        if (rms.empty()) continue;
        table.add({std::string(models[m].name), quantile(rms, 0.5), quantile(most, 0.5),
                   fmt::format("{} of {}", off, rms.size()), quantile(time, 0.5)});
    }
    return table;
}

io::Table stated(const std::vector<Played>& all, StudyResult& result) {
    io::Table table{"models_stated",
                    {"scenario", "rigid_stated_deg", "rigid_found_deg", "rigid_frames_within",
                     "rigid_stated_mm", "rigid_found_mm", "whole_stated_deg", "whole_found_deg",
                     "whole_frames_within", "whole_stated_mm", "whole_found_mm", "vessels_stay",
                     "vessels_stated_mm", "vessels_found_mm", "vessels_frames_within", "vessels_most_mm"}};
    int vessels = 0, staying = 0;
    std::vector<double> rigid_within, whole_within;
    for (const Played& p : all) {
        const ModelCourse &full = p.courses[Full], &rigid = p.courses[Rigid], &whole = p.courses[Whole];
        const LeftOut r = left_out(rigid, full), w = left_out(whole, full);
        const GiveLeftOut v = give_left_out(p.courses[Auto], full);
        table.add({p.name, r.stated / degree, r.found / degree, r.fraction, rigid.left_out_at_tip,
                   between(rigid, full).most, w.stated / degree, w.found / degree, w.fraction,
                   whole.left_out_at_tip, between(whole, full).most, v.stay, v.stated, v.found, v.within,
                   v.most});
        rigid_within.push_back(r.fraction);
        whole_within.push_back(w.fraction);
        const bool could = v.stay > 0 && v.most > 0;
        staying += could;
        vessels += could && v.found <= v.stated;
    }
    if (all.empty()) return table;
    const auto claim = [&](const char* what, const std::vector<double>& within) {
        const double fraction = quantile(within, 0.5);
        result.claim(
            fmt::format("frames in which {} leaves out no more twist than it states, median exercise", what),
            "at least 0.95", fraction, fraction >= 0.95, "");
    };
    claim("a rigid shaft", rigid_within);
    claim("a shaft wound up as a whole", whole_within);
    result.claim("exercises in which vessels that stay would be pushed aside by no more than is stated",
                 fmt::format("all {}", staying), static_cast<double>(vessels), vessels == staying, "");
    return table;
}

}  // namespace

StudyResult run_models(const StudyOptions& options) {
    std::vector<Played> all;
    std::vector<Scenario> shipped;
    std::vector<script::CommandScript> solutions;
    for (const auto& file : scenario::shipped_scenarios(options.scenarios)) {
        const auto solution = options.scenarios.parent_path() / "scripts" / (file.stem().string() + ".gw");
        if (!std::filesystem::exists(solution)) continue;
        if (options.quick && file.stem() != "s_bend" && file.stem() != "renal") continue;
        shipped.push_back(scenario::load_scenario(file, options.devices));
        solutions.push_back(script::load_commands(solution));
        all.push_back({file.stem().string(), {}});
    }
    const int count = static_cast<int>(all.size());
    Work work(options, count * model_count);
    // Exercises one after another: the first to ask for a wall makes it for the others.
    work.run(count * model_count, [&](int k) {
        const int r = k / model_count, m = k % model_count;
        all[r].courses[m] = play(shipped[r], solutions[r], models[m], options);
        return fmt::format("{}, {}", all[r].name, models[m].name);
    });
    StudyResult result;
    io::Table table = figures(all), middle = medians(table), errors = stated(all, result);
    io::Table shown{"", {table.columns.begin() + 2, table.columns.end()}};
    for (const auto& row : table.rows) shown.add({row.begin() + 2, row.end()});
    result.page = filled_text("models", {{"quick", options.quick ? " --quick" : ""},
                                         {"elsewhere", elsewhere},
                                         {"medians", io::to_markdown(middle, 3)},
                                         {"stated", io::to_markdown(errors, 3)},
                                         {"figures", io::to_markdown(shown, 3)}}) +
                  "\n";
    for (const Played& p : all)
        for (int m = 0; m < model_count; ++m)
            if (!p.courses[m].refused.empty())
                result.page += fmt::format("\n{}, {}: {}\n", p.name, models[m].name, p.courses[m].refused);
    result.tables = {std::move(table), std::move(middle), std::move(errors)};
    result.plots = {chart(all.size())};
    return result;
}

}  // namespace studies
