#include "engine/episode/reading.h"

#include <algorithm>

#include "physics/wire/energy.h"

namespace episode {

using exercise::Simulation;
using geometry::Vec3;

Reader::Reader(const Simulation& simulation)
    : ways_(std::make_shared<anatomy::VesselWays>(simulation.anatomy())) {
    aim(simulation);
}

void Reader::aim(const Simulation& simulation) {
    target_ = anatomy::nearest_place(simulation.anatomy(), simulation.target());
}

void Reader::observe(const exercise::Frame& frame) {
    const Simulation& simulation = frame.simulation;
    const physics::Guidewire& wire = simulation.wire();
    const exercise::StepReport& report = frame.motion;
    if (report.reset) {
        wire_ = catheter_ = {};
        at_rest_ = minimum_ = true;
    }
    wire_.turned += report.turned;
    catheter_.turned += report.catheter_turned;
    // A frame that asked nothing of the relaxer leaves the hands' forces as they were.
    if (report.relax.at_rest) {
        if (wire.devices.empty()) {
            wire_.push = physics::hand_force(wire, report.relax.push_force);
            wire_.torque = report.relax.base_torque;
        } else {
            const auto loads = physics::hub_loads(wire, simulation.contacts());
            for (Hand* hand : {&wire_, &catheter_}) {
                const physics::HubLoad& load =
                    loads[hand == &wire_ ? Simulation::wire_device : Simulation::catheter_device];
                hand->push = load.push;
                hand->torque = load.torque;
            }
        }
    }
    if (report.relax.updates > 0) {
        at_rest_ = report.relax.at_rest || report.relax.converged;
        minimum_ = report.relax.strict_minimum || report.relax.converged;
    }
    settling_ = report.settling;
    refused_ = report.refused;
    buckled_ = report.buckled;
    too_thick_ = report.too_thick;
    insertion_stopped_ = report.insertion_stopped;
    withdrawal_stopped_ = report.withdrawal_stopped;
    whole_wire_is_in_ = report.whole_wire_is_in;
    waits_ = report.waiting_insertion != 0 || report.waiting_rotation != 0;
}

std::optional<double> Reader::way_from(const Simulation& simulation, const Vec3& place) const {
    return ways_->between(anatomy::nearest_place(simulation.anatomy(), place), target_);
}

Reading Reader::read(const exercise::Exercise& exercise) const {
    const Simulation& simulation = exercise.simulation();
    const scenario::Scenario& scenario = simulation.scenario();
    const anatomy::Anatomy& anatomy = simulation.anatomy();
    const Simulation::Tip tip =
        simulation.tip_of(scenario.target.by_catheter ? script::Held::Catheter : script::Held::Wire);
    const anatomy::VesselPlace place = anatomy::nearest_place(anatomy, tip.at);
    Reading r;
    r.time = exercise.time();
    r.shift = simulation.vessel_shift();
    r.tip = tip.at + r.shift;
    r.direction = tip.along;
    r.target = simulation.target() + r.shift;
    r.branch = place.branch;
    r.along = geometry::length_of(std::span(anatomy.branches[place.branch].points).first(place.sample + 1));
    r.path_to_target = ways_->between(place, target_);
    r.tip_to_target = simulation.tip_to_target();
    r.wire = wire_;
    r.wire.inserted = simulation.inserted();
    r.catheter = catheter_;
    if (simulation.has_catheter()) r.catheter.inserted = simulation.inserted(script::Held::Catheter);
    if (!simulation.contacts().empty()) r.tip_force = simulation.contacts().back().force();
    r.wall_force = physics::largest_force(simulation.contacts());
    if (const exercise::Dose* dose = exercise.dose()) {
        r.air_kerma = dose->air_kerma;
        r.area_product = dose->area_product;
    }
    r.settling = settling_;
    r.at_rest = at_rest_ && !settling_;
    r.certified = r.at_rest && minimum_ && !refused_ && !waits_;
    r.refused = refused_;
    r.buckled = buckled_;
    r.too_thick = too_thick_;
    r.insertion_stopped = insertion_stopped_;
    r.withdrawal_stopped = withdrawal_stopped_;
    r.whole_wire_is_in = whole_wire_is_in_;
    r.completed = exercise.completed();
    r.on_target = r.tip_to_target <= scenario.target.radius;
    r.time_is_up = exercise.frame() >= 0 && exercise.time_is_up();
    return r;
}

void track(const geometry::Polyline& line, double spacing, std::vector<Vec3>& points) {
    if (line.empty()) {
        std::fill(points.begin(), points.end(), Vec3(Vec3::Zero()));
        return;
    }
    std::size_t i = line.size() - 1;
    Vec3 at = line.back();
    for (std::size_t k = 0; k < points.size(); ++k) {
        double left = k == 0 ? 0 : spacing;
        while (left > 0 && i > 0) {
            const double there = (line[i - 1] - at).norm();
            if (there > left) {
                at += (left / there) * (line[i - 1] - at);
                break;
            }
            left -= there;
            at = line[--i];
        }
        points[k] = at;
    }
}

}  // namespace episode
