#include "engine/room/solver_view.h"

#include <algorithm>

#include "physics/relax/relaxer.h"

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

SolverView solver_view(const exercise::Simulation& simulation, const physics::RelaxReport& relax,
                       bool error) {
    SolverView view;
    view.joints.assign(simulation.wire().joints.begin(), simulation.wire().joints.end());
    const physics::Chain& chain = simulation.wire();
    for (std::size_t i = 0; i < chain.joints.size(); ++i)
        view.radii.push_back(
            static_cast<float>(chain.inner_radius() + (i < chain.thickness.size() ? chain.thickness[i] : 0)));
    view.contacts.assign(simulation.contacts().begin(), simulation.contacts().end());
    view.shift = simulation.vessel_shift();
    constexpr double seen = 0.1;  // [mm]
    if (simulation.farthest_vessel_move() > seen || !simulation.narrowed_lumen().empty())
        view.lumen_moves = simulation.lumen_moves();
    view.relax = relax;
    view.tuning = simulation.tuning();
    if (error) view.error = distance_from_rest(simulation);
    return view;
}

}  // namespace room
