/// How a simulation's devices push the vessels aside.

#include <algorithm>

#include "engine/exercise/simulation.h"
#include "physics/wall/foundation.h"
#include "physics/wire/energy.h"

namespace exercise {

using geometry::Vec3;

double Simulation::farthest_vessel_move() const {
    double farthest = 0;
    for (const physics::WallContact& c : contacts_) farthest = std::max(farthest, c.given.norm());
    return farthest;
}

/// Of the vessels under the forces of the wire shown; empty where they do not move.
std::optional<physics::Foundation::Displacement> Simulation::displacement() const {
    if (!wall_->foundation()) return {};
    const std::vector<physics::Foundation::Load> loads = physics::vessel_loads(wire_, contacts_);
    if (loads.empty()) return {};
    return wall_->foundation()->displacement(loads);
}

/// The displacement of places, whose stations are found when they are not known.
std::vector<Eigen::Vector3f> Simulation::moved(const physics::Foundation& foundation,
                                               const physics::Foundation::Displacement& by,
                                               std::span<const Vec3> places, std::vector<int>& stations) {
    if (stations.empty())
        for (const Vec3& place : places) stations.push_back(foundation.tree().locate(place, -1));
    std::vector<Eigen::Vector3f> moves(places.size());
    for (std::size_t k = 0; k < places.size(); ++k)
        moves[k] = foundation.at(by, stations[k], places[k]).cast<float>();
    return moves;
}

std::vector<Eigen::Vector3f> Simulation::lumen_moves() const {
    const auto by = displacement();
    if (!by) return {};
    return moved(*wall_->foundation(), *by, anatomy_->lumen.vertices, vertex_stations_);
}

Simulation::VesselMoves Simulation::vessel_moves() const {
    VesselMoves moves;
    const auto by = displacement();
    if (!by) return moves;
    moves.of_nodes = moved(*wall_->foundation(), *by, contrast_->nodes(), node_stations_);
    const blood::BloodFlow& blood = contrast_->blood();
    for (const blood::Outlet& outlet : blood.outlets)
        moves.of_distal.insert(moves.of_distal.end(), blood::DistalArteries::bins,
                               moves.of_nodes[static_cast<std::size_t>(outlet.cell)]);
    for (const blood::BloodFlow::Source& source : blood.sources)
        moves.of_distal.push_back(moves.of_nodes[static_cast<std::size_t>(source.cell)]);
    return moves;
}

}  // namespace exercise
