#pragma once
/// What files of Simulation share.

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/exercise/complications.h"
#include "engine/scenario/placement.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/narrowed_wall.h"

namespace exercise {

/// Sums the reports of a frame, whose sharpest bend counts and not the last.
inline void accumulate(physics::RelaxReport& sum, const physics::RelaxReport& part) {
    const double bend = std::max(sum.largest_bend, part.largest_bend);
    sum.add(part);
    sum.largest_bend = bend;
}

/// Of a scenario's vessels, as nothing narrows them.
inline std::shared_ptr<physics::NarrowedWall> open_wall_of(const scenario::Scenario& scenario,
                                                           const anatomy::Anatomy& anatomy,
                                                           const anatomy::ModelCache& cache) {
    return std::make_shared<physics::NarrowedWall>(scenario::wall_of(scenario, anatomy, cache),
                                                   0.5 * scenario.wire().device.outer_diameter);
}

/// Whether something that was relieved has not gone from the vessels yet.
inline bool going(const Complications& complications) {
    return std::ranges::any_of(complications.all(),
                               [](const Complication& c) { return c.branch >= 0 && !c.set() && !c.gone(); });
}

/// Equal parts of a motion, each no larger than `step`.
inline int steps_of(double amount, double step) {
    return static_cast<int>(std::ceil(std::abs(amount) / step * (1 - 1e-12)));
}

}  // namespace exercise
