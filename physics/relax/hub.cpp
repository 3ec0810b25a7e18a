#include "physics/relax/hub.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "physics/wire/energy.h"

namespace physics {
namespace {

constexpr int halvings = 5;               // of a motion before it is refused
constexpr double work_share = 2;          // of the hand's work by the forces before and after
constexpr double energy_share = 0.05;     // of the wire's energy: its bends move as it does
constexpr double energy_floor = 1e-3;     // [N·mm]
constexpr double sharpest = degree * 90;  // of a joint

const RelaxerConfig& checked(const RelaxerConfig& config) {
    if (config.kind != RelaxerKind::Global) throw std::invalid_argument("a hub needs the global relaxer");
    return config;
}

}  // namespace

Hub::Hub(const RelaxerConfig& config, const LumenWall& wall) : relaxer_(checked(config), wall), wall_(wall) {}

double Hub::energy_of(const Guidewire& wire) const {
    return total_energy(wire, relaxer_.contacts()).total();
}

/// Whether a wire can rest there after this motion from the last rest.
bool Hub::can_be(const Guidewire& wire, const RelaxReport& report) const {
    // A flat minimum is a rest, and on planes, which jump, there may be none.
    const bool rests = report.at_rest || !wall_.smooth();
    if (!rests || report.largest_bend > sharpest) return false;
    for (const WallContact& c : relaxer_.contacts())
        if (c.room > 0 && c.penetration > c.room) return false;
    const double energy = energy_of(wire);
    double force = std::max(std::abs(report.push_force), std::abs(rest_report_.push_force));
    double torque = std::max(std::abs(report.base_torque), std::abs(rest_report_.base_torque));
    // Of several devices one may push and another pull by more than both together.
    if (!wire.devices.empty())
        for (const std::vector<HubLoad>* loads : {&loads_, &rest_loads_})
            for (const HubLoad& load : *loads) {
                force = std::max(force, std::abs(load.push));
                torque = std::max(torque, std::abs(load.torque));
            }
    const double work = force * std::abs(made_.feed) + torque * std::abs(made_.turn);
    return energy - rest_energy_ <= work_share * work + energy_share * std::abs(rest_energy_) + energy_floor;
}

/// Whether a shaft outside bows under the push of the motion that was tried.
bool Hub::buckles(const Guidewire& wire) const {
    if (!(made_.feed > 0) || !loads_at_rest_) return false;
    for (int k = 0; k < static_cast<int>(loads_.size()); ++k) {
        const bool alone = wire.devices.empty();
        if (!alone && made_.device != every_device && made_.device != k) continue;
        const double limit = alone ? wire.spec.buckling_force : wire.devices[k].spec.buckling_force;
        if (limit > 0 && loads_[k].push > limit) return true;
    }
    return false;
}

void Hub::find_loads(const Guidewire& wire, const RelaxReport& report) {
    loads_at_rest_ = report.at_rest;
    if (wire.devices.empty())
        loads_ = {{hand_force(wire, report.push_force), report.base_torque}};
    else
        loads_ = hub_loads(wire, relaxer_.contacts());
}

HubReport Hub::settle(Guidewire& wire, int updates) {
    working_ = settling_ = true;
    rest_ = wire;
    made_ = {};
    return resume(wire, updates);
}

HubReport Hub::move(Guidewire& wire, const HubMotion& motion, int updates) {
    const double lambda = wire.spec.segment_length;
    asked_ = {std::clamp(motion.feed, -lambda, lambda), std::clamp(motion.turn, -largest_turn, largest_turn),
              motion.device};
    halvings_ = 0;
    rest_ = wire;
    working_ = true;
    settling_ = false;
    rest_report_ = relaxer_.last_report();
    rest_energy_ = energy_of(wire);
    rest_loads_.clear();
    if (!wire.devices.empty()) rest_loads_ = hub_loads(wire, relaxer_.contacts());
    HubReport report;
    start_part(wire, updates, report);
    return finish(wire, updates, report);
}

/// One part of the motion, from the last rest.
void Hub::start_part(Guidewire& wire, int updates, HubReport& report) {
    const double share = std::ldexp(1.0, -halvings_);
    made_ = {share * asked_.feed, share * asked_.turn, asked_.device};
    report.relax.add(relaxer_.move(wire, made_, {updates - report.relax.updates, 0, 0}));
}

HubReport Hub::resume(Guidewire& wire, int updates) {
    HubReport report;
    report.relax.add(relaxer_.relax(wire, {updates, 0, 0}));
    return finish(wire, updates, report);
}

/// After a relaxation: at rest, out of budget, or to be tried again in halves.
HubReport Hub::finish(Guidewire& wire, int updates, HubReport report) {
    for (;;) {
        if (report.relax.out_of_budget) {
            loads_at_rest_ = false;
            report.outcome = HubReport::Outcome::Working;
            return report;
        }
        find_loads(wire, report.relax);
        const bool buckles = this->buckles(wire);
        report.buckled = report.buckled || buckles;
        if (settling_ || (!buckles && can_be(wire, report.relax))) {
            working_ = settling_ = false;
            report.made = made_;
            return report;
        }
        wire = rest_;
        made_ = {};
        report.relax.add(relaxer_.relax(wire, {2 * wire.segments(), 0, 0}));
        if (++halvings_ > halvings) {
            working_ = false;
            report.outcome = HubReport::Outcome::Refused;
            find_loads(wire, report.relax);
            return report;
        }
        start_part(wire, updates, report);
    }
}

}  // namespace physics
