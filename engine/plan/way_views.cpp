#include "engine/plan/way_views.h"

#include "engine/plan/stand.h"
#include "engine/plan/view_pictures.h"
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

Course with_views(Course course, const std::vector<StepViews>& steps, const anatomy::Anatomy& anatomy,
                  const std::vector<Moment>& moments) {
    std::vector<author::ScriptLine> lines = {{0, 0, script::Beam{true}}};
    std::size_t next = 0;
    for (std::size_t frame = 0; frame < moments.size() && next < steps.size(); ++frame)
        for (std::size_t k = next; k < steps.size(); ++k) {
            if (!holds(steps[k], anatomy, moments[frame].tip)) continue;
            next = k + 1;
            if (steps[k].best.empty()) break;
            script::MoveArm arm;
            arm.lao = steps[k].best.front().angles.lao;
            arm.cranial = steps[k].best.front().angles.cranial;
            // Tenths of a millimetre, as a table moves.
            arm.isocentre = (10 * steps[k].middle).array().round() / 10;
            lines.push_back({static_cast<int>(frame), static_cast<int>(frame), arm});
            break;
        }
    lines.insert(lines.end(), course.lines.begin(), course.lines.end());
    std::ranges::stable_sort(lines, {}, &author::ScriptLine::first);
    course.lines = std::move(lines);
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
