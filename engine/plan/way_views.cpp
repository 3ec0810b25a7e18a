#include "engine/plan/way_views.h"

#include <cmath>
#include <optional>

#include "engine/plan/stand.h"
#include "engine/plan/view_pictures.h"
#include "engine/room/grasp.h"
#include "engine/scenario/placement.h"
#include "render/picture/png.h"

namespace plan {
namespace {

std::vector<bool> filled_of(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy) {
    const auto flushed = anatomy::branch_named(anatomy, scenario.entry.flush_catheter);
    return filled_from(anatomy, scenario.entry.flush_catheter.empty() ? -1 : flushed.value_or(-1));
}

bool holds(const StepViews& step, const anatomy::Anatomy& anatomy, const geometry::Vec3& place) {
    const anatomy::VesselPlace at = anatomy::nearest_place(anatomy, place);
    const double along = anatomy::along(anatomy, at) - anatomy::origin_of(anatomy, at.branch);
    for (const ViewStretch& stretch : step.target.stretches)
        if (stretch.branch == at.branch && along >= stretch.from - 1 && along <= stretch.to + 1) return true;
    return false;
}

constexpr double flushed_from = 5;                    // radius of a vessel that the injector fills [mm]
constexpr double flush_volume = 20, flush_rate = 20;  // [ml], [ml/s]
constexpr int mask_frames = 2;                        // before contrast comes
constexpr double run_on = 1;                          // after the injection's end, for the peak [s]
constexpr double run_pulses = 7.5;                    // of DSA [1/s]

room::InjectionPreset injection_of(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy) {
    room::InjectionPreset preset;
    preset.site = room::InjectionPreset::Site::Device;
    const std::string& branch = scenario.entry.flush_catheter;
    const auto flushed = anatomy::branch_named(anatomy, branch);
    if (branch.empty() || !flushed) return preset;
    preset.site = room::InjectionPreset::Site::Branch;
    preset.branch = branch;
    if (anatomy.branches[static_cast<std::size_t>(*flushed)].radii.front() < flushed_from) return preset;
    preset.by = room::InjectionPreset::By::Pump;
    preset.volume = flush_volume;
    preset.rate = flush_rate;
    return preset;
}

/// An angiogram as lines from frame 0 on, and how many frames hands wait for it.
struct Run {
    std::vector<author::ScriptLine> lines;
    int frames = 0;
};
Run run_of(const script::Inject& inject, const scenario::Scenario& scenario) {
    using script::ImagingMode;
    const double rate = scenario.frame_rate;
    const int peak = mask_frames +
                     static_cast<int>(std::ceil((inject.volume / inject.rate + run_on / 2) * rate)),
              end = peak + static_cast<int>(std::ceil(run_on / 2 * rate));
    const bool dsa = scenario.imaging.acquisition == ImagingMode::Dsa;
    Run run;
    run.frames = end + 1;
    const auto add = [&](int frame, script::Command command) {
        run.lines.push_back({frame, frame, std::move(command)});
    };
    add(0, script::SetMode{scenario.imaging.acquisition});
    const double usual = scenario.imaging.pulse_rate.value_or(rate);
    const bool slower = dsa && usual > run_pulses && script::is_pulse_rate(usual);
    if (slower) add(0, script::SetPulseRate{run_pulses});
    if (dsa) add(0, script::NewMask{});
    add(mask_frames, inject);
    if (dsa) add(peak, script::StoreReference{});
    add(end, script::SetMode{dsa ? ImagingMode::Roadmap : ImagingMode::Live});
    if (slower) add(end, script::SetPulseRate{usual});
    return run;
}

/// Lines that begin at this frame or later do so later by `frames`, and one that goes on across it waits.
void wait(std::vector<author::ScriptLine>& lines, int frame, int frames) {
    std::vector<author::ScriptLine> waited;
    for (author::ScriptLine line : lines) {
        if (line.first < frame && line.last >= frame) {
            waited.push_back({line.first, frame - 1, line.command});
            line.first = frame;
        }
        if (line.first >= frame) {
            line.first += frames;
            line.last += frames;
        }
        waited.push_back(std::move(line));
    }
    lines = std::move(waited);
}

}  // namespace

std::vector<StepViews> views_on_way(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
                                    const anatomy::ModelCache& cache) {
    std::vector<StepViews> steps;
    const auto end = anatomy::find_end(anatomy, scenario.entry.end);
    if (!end) return steps;
    const geometry::Vec3 entry = anatomy.ends[static_cast<std::size_t>(*end)].opening.centre;
    const std::vector<bool> filled = filled_of(scenario, anatomy);
    const Stand stand = stand_of(scenario, anatomy, cache);
    for (const ViewTarget& target :
         view_targets_on_way(anatomy, entry, scenario::target_of(scenario, anatomy))) {
        const ViewedTarget viewed(anatomy, target, filled);
        steps.push_back({target, viewed.middle(), best_views(view_map(viewed, stand))});
    }
    return steps;
}

Course with_views(Course course, const std::vector<StepViews>& steps, exercise::Exercise start,
                  bool angiograms) {
    const exercise::Simulation& simulation = start.simulation();
    const room::InjectionPreset preset = injection_of(simulation.scenario(), simulation.anatomy());
    std::vector<author::ScriptLine> lines = course.lines, views = {{0, 0, script::Beam{true}}};
    std::size_t next = 0;
    int later = 0;  // what follows, for the angiograms before it [frames]
    double given = 0;
    play(start, course.script(), [&] {
        const int frame = start.frame();
        for (std::size_t k = next; k < steps.size(); ++k) {
            if (!holds(steps[k], simulation.anatomy(), simulation.tip())) continue;
            next = k + 1;
            if (steps[k].best.empty()) break;
            script::MoveArm arm;
            arm.lao = steps[k].best.front().angles.lao;
            arm.cranial = steps[k].best.front().angles.cranial;
            // Tenths of a millimetre, as a table moves.
            arm.isocentre = (10 * steps[k].middle).array().round() / 10;
            const int at = frame + later;
            views.push_back({at, at, arm});
            if (!angiograms || given + preset.volume > simulation.contrast().left()) break;
            const std::optional<script::Inject> inject = room::inject(preset, simulation).command;
            if (!inject) break;
            given += inject->volume;
            const Run run = run_of(*inject, simulation.scenario());
            wait(lines, at, run.frames);
            for (author::ScriptLine line : run.lines) {
                line.first += at;
                line.last += at;
                views.push_back(std::move(line));
            }
            later += run.frames;
            break;
        }
    });
    views.insert(views.end(), lines.begin(), lines.end());
    std::ranges::stable_sort(views, {}, &author::ScriptLine::first);
    course.lines = std::move(views);
    course.frames += later;
    return course;
}

std::vector<std::vector<std::uint8_t>> pictures_of(const scenario::Scenario& scenario,
                                                   const anatomy::Anatomy& anatomy,
                                                   const std::vector<StepViews>& steps,
                                                   const anatomy::ModelCache& cache) {
    const std::vector<bool> filled = filled_of(scenario, anatomy);
    std::vector<std::vector<std::uint8_t>> pictures;
    for (const StepViews& step : steps) {
        pictures.emplace_back();
        if (step.best.empty()) continue;
        const std::vector<BestView> first = {step.best.front()};
        pictures.back() = render::encode_png(
            view_pictures(scenario, ViewedTarget(anatomy, step.target, filled), filled, first, cache)
                .front());
    }
    return pictures;
}

}  // namespace plan
