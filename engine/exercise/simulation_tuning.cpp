/// What an instructor changes while the wire is inside.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/exercise/simulation.h"
#include "engine/exercise/simulation_parts.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/scenario/placement.h"

namespace exercise {

Tuning Simulation::tuning() const {
    const scenario::Device& wire = scenario_.wire().device;
    return {wire.shaft_rigidity(),
            physics::rigidity_at(wire, 0),
            scenario_.segment_length,
            scenario_.wall_stiffness,
            wire.friction,
            scenario_.relaxer};
}

void Simulation::retune(const Tuning& tuning, const anatomy::ModelCache& cache) {
    scenario::Scenario changed = scenario_;
    scenario::Device& wire = changed.wire().device;
    if (tuning.shaft_rigidity != this->tuning().shaft_rigidity ||
        tuning.tip_rigidity != this->tuning().tip_rigidity) {
        std::optional<scenario::TipAndShaft> stiffness = scenario::tip_and_shaft(wire);
        if (!stiffness)
            throw io::InputError(
                "expected a wire of a tip, a transition and a shaft, whose rigidities can be "
                "changed, found one of other sections");
        // The torsional rigidity of the shaft stays.
        stiffness->shaft_rigidity = tuning.shaft_rigidity;
        stiffness->tip_rigidity = tuning.tip_rigidity;
        scenario::set_stiffness(wire, *stiffness);
    }
    if (tuning.friction != wire.friction) {
        // The static coefficient stays the same multiple of it.
        const double multiple = wire.friction > 0 ? wire.static_friction / wire.friction : 0;
        wire.static_friction = std::min(physics::DeviceLimits::friction, multiple * tuning.friction);
        wire.friction = tuning.friction;
    }
    changed.segment_length = tuning.segment_length;
    changed.wall_stiffness = tuning.wall_stiffness;
    changed.relaxer = tuning.relaxer;
    if (const auto wrong = scenario::problems(changed); !wrong.empty())
        throw io::InputError(io::joined(wrong, "\n"));
    if (!std::isfinite(tuning.wall_stiffness) || tuning.wall_stiffness <= 0)
        throw io::InputError("a wall of {} N/mm; expected a stiffness above 0", tuning.wall_stiffness);
    static_cast<void>(scenario::entry_of(changed, *anatomy_));  // for a later reset
    const double length = wire_.inserted_length(), least = physics::least_length({changed.segment_length});
    if (length < least)
        throw io::InputError("{:.1f} mm of wire are inside; expected {:.1f} mm or more with such segments",
                             length, least);

    const bool other_wall = changed.wall_stiffness != scenario_.wall_stiffness;
    std::shared_ptr<physics::NarrowedWall> wall;
    if (other_wall) wall = open_wall_of(changed, *anatomy_, cache);
    hub_.reset();  // they belong to the wall
    relaxer_.reset();
    if (wall) wall_ = std::move(wall);
    take_up_changes();
    scenario_ = std::move(changed);
    if (exchanged_name_.empty()) place_devices();
    know_vessels();
    waiting_.clear();
    const physics::Chain before = wire_;
    geometry::Polyline path(before.joints.begin(), before.joints.end());
    path.push_back(path.back() +
                   (3 * scenario_.segment_length + 1) * before.tangents.back());  // chords are shorter
    lay(path, &before);
}

}  // namespace exercise
