/// How sure a simulation is of what it shows.

#include "engine/exercise/simulation.h"

namespace exercise {

std::optional<physics::DiscretisationError> Simulation::tip_error(bool by_segment) const {
    if (!hub_ || !readings_.at_rest || !readings_.strict_minimum || readings_.motion.settling) return {};
    return physics::ErrorEstimator(*wall_).of(wire_, contacts_, by_segment);
}

}  // namespace exercise
