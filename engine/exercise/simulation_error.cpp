/// How sure a simulation is of what it shows.

#include "engine/exercise/simulation.h"

namespace exercise {

std::optional<physics::DiscretisationError> Simulation::tip_error(bool by_segment) const {
    if (!hub_ || !readings_.at_rest || !readings_.strict_minimum || readings_.motion.settling) return {};
    return physics::ErrorEstimator(*wall_).of(wire_, contacts_, by_segment);
}

const geometry::MeshQuery& Simulation::lumen_query() const {
    std::call_once(lumen_query_->once, [this] { lumen_query_->query.emplace(anatomy_->lumen); });
    return *lumen_query_->query;
}

}  // namespace exercise
