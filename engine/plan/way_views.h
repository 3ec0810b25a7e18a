#pragma once
/// Views for each step of a course: the arm goes to the best angles for the vessel that the tip is in.

#include <string>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/exercise/exercise.h"
#include "engine/plan/judge.h"
#include "engine/plan/views.h"
#include "engine/scenario/scenario.h"

namespace plan {

/// A part of the way, and what shows it.
struct StepViews {
    ViewTarget target;
    geometry::Vec3 middle = geometry::Vec3::Zero();  // the isocentre [mm]
    std::vector<BestView> best;                      // empty where the stand takes no view
};

/// Of each part of the way from the entry to the target. Without a named end, or a way, none.
std::vector<StepViews> views_on_way(const scenario::Scenario&, const anatomy::Anatomy&,
                                    const anatomy::ModelCache&);

/// The course with the beam on, and the arm in the best view of each step from the frame on in which the tip
/// enters it. `angiograms`: hands then wait for one of the step in that view, of what is left of the
/// patient's limit of contrast: by the injector into the aorta, 20 ml in a second, where the scenario has a
/// flush catheter in so wide a vessel, else by hand, 5 ml in 2.5 s, where it is or through the device around
/// the wire or the introducer. DSA becomes the roadmap of what follows; cine is taken where the scenario's
/// acquisition is cine. `start` is what the course begins from.
Course with_views(Course, const std::vector<StepViews>&, exercise::Exercise start, bool angiograms);

/// PNG of the best view of each step, as view_pictures() makes them. Throws InputError.
std::vector<std::vector<std::uint8_t>> pictures_of(const scenario::Scenario&, const anatomy::Anatomy&,
                                                   const std::vector<StepViews>&, const anatomy::ModelCache&);

}  // namespace plan
