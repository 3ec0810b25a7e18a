/// A frame of a simulation with one of the paper's relaxers, of segments.

#include <algorithm>
#include <cmath>

#include "engine/exercise/simulation.h"
#include "engine/exercise/simulation_parts.h"
#include "physics/wire/crossings.h"
#include "physics/wire/energy.h"

namespace exercise {
namespace {

/// Segment relaxers get more than the frame's budget for long motions: each step at least this part of it, or
/// the wire leaves the vessel.
constexpr int least_fraction = 8;

}  // namespace

void Simulation::move_segments(StepReport& report) {
    if (!waiting_.empty() && scenario_.adaptive) physics::refine(wire_, *wall_, scenario_.refinement);
    int parts = 0;
    for (Motion& m : waiting_)
        if (m.removes) m.insertion = -wire_.devices[m.device].inserted;
    for (const Motion& m : waiting_)
        parts += steps_of(m.insertion, wire_.grid.segment_length) +
                 steps_of(m.rotation, physics::Hub::largest_turn);
    // One part more for the frame's end, so that a frame with a motion settles as one without.
    const int budget = scenario_.budget.updates,
              fraction = std::max({1, budget / (parts + 1), budget / least_fraction});
    for (Motion& motion : waiting_) {
        if (!motion.exchange.empty()) exchange_device(motion, report);
        if (motion.insertion != 0) feed_segments(motion, fraction, report);
        if (motion.rotation != 0) turn(motion, fraction, report);
    }
    waiting_.clear();
    relax(std::max(fraction, budget - report.relax.updates), report);
    contacts_ = physics::all_contacts(wire_, *wall_);
    report.deepest_crossing = 0;
    for (const physics::Crossing& crossing : physics::crossings(wire_, contacts_, *wall_))
        report.deepest_crossing = std::max(report.deepest_crossing, crossing.depth);
}

void Simulation::feed_segments(Motion& motion, int fraction, StepReport& report) {
    double fed = 0;
    while ((motion.insertion = allowed_feed(motion, report)) != 0) {
        const int steps = steps_of(motion.insertion, wire_.grid.segment_length);
        const double wanted = motion.insertion / steps;
        fed += physics::feed(wire_, motion.device, wanted);
        motion.insertion = steps == 1 ? 0 : motion.insertion - wanted;
        relax(fraction, report);
    }
    report.insertions.push_back(fed);
}

void Simulation::turn(Motion& motion, int fraction, StepReport& report) {
    const int steps = steps_of(motion.rotation, physics::Hub::largest_turn);
    const double wanted = motion.rotation / steps;
    for (int step = 0; step < steps; ++step) {
        physics::rotate(wire_, motion.device, wanted);
        report.rotation += std::abs(wanted);
        count_turn(motion.device, wanted);
        relax(fraction, report);
    }
    motion.rotation = 0;
}

void Simulation::relax(int updates, StepReport& report) {
    const physics::RelaxBudget budget = {updates, scenario_.budget.distal_fraction,
                                         scenario_.budget.distal_segments};
    accumulate(report.relax, relaxer_->relax(wire_, budget));
}

}  // namespace exercise
