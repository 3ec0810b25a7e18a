/// What a simulation does with several devices on one chain.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <utility>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/lumen_flow.h"
#include "engine/exercise/simulation.h"
#include "physics/wire/energy.h"

namespace exercise {

using geometry::Vec3;

/// Wire and catheter along the path, as they were before or as the scenario begins.
physics::Guidewire Simulation::chain(const geometry::Polyline& path, double length,
                                     const physics::Guidewire* before) const {
    std::vector<physics::CoaxialDevice> devices(2);
    devices[wire_device].spec = scenario_.wire_device();
    devices[wire_device].inserted = length;
    physics::CoaxialDevice& catheter = devices[catheter_device];
    catheter.spec = scenario_.catheter->device;
    catheter.spec.friction *= scenario_.wall_friction;
    catheter.inserted = scenario_.catheter->inserted;
    catheter.roll = scenario_.catheter->roll;
    if (before)
        for (std::size_t k = 0; k < devices.size(); ++k) {
            devices[k].inserted = before->devices[k].inserted;
            devices[k].roll = before->devices[k].roll;
            devices[k].windup = before->devices[k].windup;
        }
    if (before && exchanged_) devices[wire_device].spec = before->devices[wire_device].spec;
    physics::Guidewire wire = physics::coaxial_chain(devices, scenario_.guidewire.segment_length, path);
    if (before) {
        wire.tangents[0] = before->tangents[0];
        wire.base_director = before->base_director;
    }
    return wire;
}

double Simulation::inserted(script::Held held) const {
    if (wire_.devices.empty())
        return held == script::Held::Wire ? wire_.inserted_length() + wire_.carried : 0;
    return wire_.devices[held == script::Held::Catheter ? catheter_device : wire_device].inserted;
}

geometry::Polyline Simulation::path_of(script::Held held) const {
    if (wire_.devices.empty() && held == script::Held::Wire) return wire_.joints;
    double left = inserted(held);
    geometry::Polyline path;
    if (left <= 0) return path;
    path.push_back(wire_.joints[0]);
    for (int i = 1; i <= wire_.segments() && left > 1e-9; left -= wire_.lengths[i], ++i)
        path.push_back(left >= wire_.lengths[i] ? wire_.joints[i]
                                                : Vec3(wire_.joints[i - 1] + left * wire_.tangents[i]));
    return path;
}

Simulation::Tip Simulation::tip_of(script::Held held) const {
    const geometry::Polyline path = path_of(held);
    if (path.empty()) return {wire_.joints[0], wire_.tangents[0]};
    return {path.back(), wire_.tangents[path.size() - 1]};
}

geometry::Vec3 Simulation::tip() const {
    return tip_of(scenario_.target.by_catheter ? script::Held::Catheter : script::Held::Wire).at;
}

double Simulation::passes_on(int device) const {
    return hub_ ? hub_->passes_on(wire_, device) : std::numeric_limits<double>::infinity();
}

double Simulation::largest_flow() const {
    if (!scenario_.catheter || inserted(script::Held::Catheter) <= 0) return 0;
    const physics::DeviceSpec &catheter = wire_.devices[catheter_device].spec,
                              &wire = wire_.devices[wire_device].spec;
    // The wire that is not in the body is in the part of the catheter outside, if it is in it at all.
    const double outside = catheter.length - inserted(script::Held::Catheter);
    const double in = inserted();
    return exercise::largest_flow(catheter, wire.outer_diameter,
                                  in <= 0 ? 0 : outside + std::min(in, inserted(script::Held::Catheter)));
}

int Simulation::device_of(script::Held held) const {
    if (!scenario_.catheter || held == script::Held::Both) return physics::every_device;
    return held == script::Held::Wire ? wire_device : catheter_device;
}

void Simulation::inject_through_catheter(const script::Inject& command) {
    const auto deny = [this](std::string why) { denied_ = "Nothing was injected: " + std::move(why); };
    if (inserted(script::Held::Catheter) <= 0) return deny("the catheter is not inside");
    const double most = largest_flow();
    if (command.rate > most)
        return deny(most < 0.1 ? "the wire fills the catheter's lumen"
                               : fmt::format("the lumen passes {:.1f} ml/s at most", most));
    const geometry::Vec3 at = tip_of(script::Held::Catheter).at;
    contrast_->inject({at, command.rate, command.volume, command.iodine});
}

/// The part of a motion of one of several devices that its length and the vessels allow [mm].
double Simulation::allowed_feed(const Motion& motion, StepReport& report) const {
    double most = motion.insertion;
    double still = 0, longest = 0;
    for (int k = 0; k < static_cast<int>(moving_.devices.size()); ++k) {
        const physics::CoaxialDevice& device = moving_.devices[k];
        const bool moves = motion.device == physics::every_device ? device.inserted > 0 : motion.device == k;
        (moves ? longest : still) = std::max(moves ? longest : still, device.inserted);
        if (!moves) continue;
        const double left = std::max(0.0, device.spec.length - device.inserted);
        if (most > left + 1e-9) report.whole_wire_is_in = true;
        most = std::min(most, left);
        most = std::max(most, -device.inserted);
    }
    if (most < 0 && still < physics::least_chain(moving_)) {
        const double least = std::min(0.0, physics::least_chain(moving_) - longest);
        if (most < least - 1e-9) report.withdrawal_stopped = true;
        most = std::max(most, least);
    }
    if (most > 0 && longest + 1e-9 >= moving_.inserted_length() && tip_has_left()) {
        report.insertion_stopped = true;
        return 0;
    }
    if (most > 0 && motion.device != wire_device && stands_before_a_narrow_vessel()) {
        report.too_thick = true;
        return 0;
    }
    return std::abs(most) < 1e-12 ? 0 : most;
}

/// Whether the catheter's tip has come to a place that is narrower than it is, here or a segment ahead.
bool Simulation::stands_before_a_narrow_vessel() const {
    const physics::CoaxialDevice& catheter = moving_.devices[catheter_device];
    double left = catheter.inserted;
    if (left <= 0) return false;
    int i = 1;
    for (; i < moving_.segments() && left > moving_.lengths[i]; ++i) left -= moving_.lengths[i];
    const Vec3 tip = moving_.joints[i - 1] + left * moving_.tangents[i];
    const Vec3 places[] = {tip, tip + moving_.spec.segment_length * moving_.tangents[i]};
    physics::WallContact contacts[2];
    for (physics::WallContact& contact : contacts) contact.station = moving_.stations[i];
    wall_->contacts(places, contacts);
    // The wall takes the radius of the chain's own wire off the lumen's.
    return std::any_of(std::begin(contacts), std::end(contacts), [&](const physics::WallContact& contact) {
        return contact.room > 0 &&
               contact.room + 0.5 * moving_.spec.diameter < 0.5 * catheter.spec.outer_diameter;
    });
}

/// The wire becomes another where it is out.
void Simulation::exchange(Motion& motion, StepReport& report) {
    const std::string name = std::exchange(motion.exchange, {});
    if (moving_.devices[wire_device].inserted > 0) {
        report.denied = "The wire was not exchanged: it is still in; remove it first";
        return;
    }
    const scenario::Device device = wire_of_catalogue(name, scenario_);
    physics::CoaxialDevice& wire = moving_.devices[wire_device];
    wire.spec = device;
    wire.spec.friction *= scenario_.wall_friction;
    if (scenario_.torsion == scenario::TorsionModel::Rigid) wire.spec.torsional_rigidity = 0;
    wire.roll = wire.windup = 0;
    moving_.spec.friction = std::max(moving_.spec.friction, wire.spec.friction);
    physics::assign_devices(moving_);
    if (moving_.grips.empty()) physics::start_grips(moving_);
    report.exchanged = device.title;
    exchanged_name_ = name;
    exchanged_ = device;
}

}  // namespace exercise
