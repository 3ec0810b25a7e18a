#include "engine/room/solver_view.h"

#include <algorithm>

namespace room {
namespace {

/// Largest distance of a joint from where the fast solver brings it to rest [mm].
double distance_from_rest(const exercise::Simulation& simulation) {
    physics::Chain rest = simulation.wire();
    physics::RelaxerConfig config;
    if (!simulation.wall().smooth()) config.tolerance = 1e-3;
    physics::make_relaxer(config, simulation.wall())->relax(rest, {400 * rest.segments(), 0, 0});
    double largest = 0;
    for (std::size_t i = 0; i < rest.joints.size(); ++i)
        largest = std::max(largest, (rest.joints[i] - simulation.wire().joints[i]).norm());
    return largest;
}

}  // namespace

SolverView solver_view(const exercise::Simulation& simulation, const physics::RelaxReport& relax) {
    SolverView view;
    view.joints.assign(simulation.wire().joints.begin(), simulation.wire().joints.end());
    view.contacts.assign(simulation.contacts().begin(), simulation.contacts().end());
    view.shift = simulation.vessel_shift();
    view.relax = relax;
    view.tuning = simulation.tuning();
    view.error = distance_from_rest(simulation);
    return view;
}

}  // namespace room
