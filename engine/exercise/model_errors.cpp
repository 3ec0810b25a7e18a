#include "engine/exercise/model_errors.h"

#include <algorithm>

namespace exercise {

std::optional<physics::Response> response_of(const Simulation& simulation, physics::Grips grips) {
    const Readings& now = simulation.readings();
    if (!now.at_rest || !now.strict_minimum || now.motion.settling) return {};
    physics::Response response(simulation.wall(), simulation.wire(), grips);
    if (!response.exists()) return {};
    return response;
}

std::optional<double> twist_error(const Simulation& simulation, const physics::Response& response) {
    std::optional<double> tip;
    for (int k = 0; k < static_cast<int>(simulation.devices().size()); ++k) {
        const scenario::TorsionNeed need = simulation.torsion_need(k);
        if (simulation.torsion(k) != physics::Torsion::Rigid || need.give == 0) continue;
        // A spring of 1/give, against which the torque grows or falls as it turns.
        const double spring = 1 + need.give * response.torque_curve(k);
        const auto moved = response.to_turn(k, need.winds_up_now);
        if (!moved || !(spring > 0)) return {};
        tip = tip.value_or(0) + moved->tip().norm() / spring;
    }
    return tip;
}

ModelErrors model_errors(const Simulation& simulation) {
    ModelErrors errors;
    const auto response = response_of(simulation, physics::Grips::Slide);
    if (!response) return errors;
    const physics::NarrowedWall& wall = simulation.wall();
    // In closed form the mesh is what is only nearly the wall; a narrowed lumen is another one.
    if (simulation.scenario().wall_model == scenario::WallModel::DistanceField && wall.narrowings().empty()) {
        const physics::Response::OtherWall mesh = response->to_mesh(simulation.lumen_query());
        errors.wall_off = mesh.most_off;
        if (mesh.moved) errors.wall = mesh.moved->tip().norm();
    }
    if (wall.foundation() && simulation.wire().vessels_stay)
        if (const auto moved = response->to_vessels(*wall.foundation())) errors.vessels = moved->tip().norm();
    errors.twist = twist_error(simulation, *response);
    return errors;
}

}  // namespace exercise
