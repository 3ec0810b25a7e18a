/// What a simulation does with several devices on one chain, and with hands and valves outside.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <utility>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/simulation.h"
#include "physics/wire/rub_forces.h"

namespace exercise {

using geometry::Vec3;

namespace {

/// A wire that goes through an open end passes within this many of its radii.
constexpr double opening_reach = 1.5;
/// Corrections of what friction moves after each part of a motion.
constexpr int most_drags = 8;

}  // namespace

double Simulation::inserted(script::DeviceRole held) const {
    const std::optional<int> device = scenario_.index_of(held);
    return device ? wire_.devices[*device].inserted : 0;
}

Hand Simulation::hand(script::DeviceRole held) const {
    const std::optional<int> device = scenario_.index_of(held);
    return device ? readings_.hands[*device] : Hand();
}

std::optional<double> Simulation::gripped_at(script::DeviceRole held) const {
    const std::optional<int> device = scenario_.index_of(held);
    if (!device || !hub_) return std::nullopt;
    return outside_.shaft(*device).length;
}

geometry::Polyline Simulation::path_of(script::DeviceRole held) const {
    if (held == script::DeviceRole::Wire && devices_.size() == 1) return wire_.joints;
    double left = inserted(held);
    geometry::Polyline path;
    if (left <= 0) return path;
    path.push_back(wire_.joints[0]);
    for (int i = 1; i <= wire_.segments() && left > 1e-9; left -= wire_.lengths[i], ++i)
        path.push_back(left >= wire_.lengths[i] ? wire_.joints[i]
                                                : Vec3(wire_.joints[i - 1] + left * wire_.tangents[i]));
    return path;
}

Simulation::Tip Simulation::tip_of(script::DeviceRole held) const {
    const geometry::Polyline path = path_of(held);
    if (path.empty()) return {wire_.joints[0], wire_.tangents[0]};
    return {path.back(), wire_.tangents[path.size() - 1]};
}

geometry::Vec3 Simulation::tip() const {
    return tip_of(scenario_.target.device).at;
}

/// The wire has left by an end if it passed the end's opening outward more often than inward.
bool Simulation::tip_has_left() const {
    return std::ranges::any_of(anatomy_->ends, [&](const anatomy::VesselEnd& end) {
        const geometry::OpenEnd& opening = end.opening;
        const double reach = opening_reach * opening.radius;
        int out = 0;
        double before = std::min(0.0, (wire_.joints[0] - opening.centre).dot(opening.outward_normal));
        for (int i = 1; i <= wire_.segments(); ++i) {
            const double beyond = (wire_.joints[i] - opening.centre).dot(opening.outward_normal);
            if ((beyond > 0) != (before > 0)) {
                const double part = before / (before - beyond);
                const Vec3 at = wire_.joints[i - 1] + part * (wire_.joints[i] - wire_.joints[i - 1]);
                if ((at - opening.centre).norm() < reach) out += beyond > 0 ? 1 : -1;
            }
            before = beyond;
        }
        return out > 0;
    });
}

double Simulation::passes_on(int device) const {
    return hub_ ? outside_.passes_on(device) : std::numeric_limits<double>::infinity();
}

/// The hand takes the shaft elsewhere, with the push and torque that it has.
void Simulation::grip(int device, double distance) {
    if (!hub_) return;
    outside_.grip(device, devices_, distance);
    for (int k = 0; k < static_cast<int>(devices_.size()); ++k) readings_.hands[k].bow = outside_.bow(k);
    physics::hold_at(moving_, device, distance);
    wire_.devices[device] = moving_.devices[device];
    if (hub_is_idle()) balance();
}

/// Somebody holds the device from now on, or nobody, whatever a hand did last.
void Simulation::pin(int device, bool on) {
    scenario::PlacedDevice& placed = devices_[device];
    if (!on && placed.device.holding_valve_friction() == 0) {
        denied_ =
            fmt::format("Nobody can let go of the {}: its valve has no friction to hold it", placed.name());
        return;
    }
    if (placed.pinned == on && chain().devices[device].held == on) return;
    placed.pinned = on;
    std::erase(pinned_otherwise_, device);
    if (on != scenario_.devices[device].pinned)
        pinned_otherwise_.insert(std::ranges::lower_bound(pinned_otherwise_, device), device);
    if (!hub_) return;
    moving_.devices[device].held = wire_.devices[device].held = on;
    if (!on) outside_.hold(devices_, moving_, false);
    if (hub_is_idle()) balance();
}

/// Those of the scenario, with what this attempt has changed of them.
void Simulation::place_devices() {
    devices_ = scenario_.devices;
    if (!exchanged_name_.empty()) devices_[0].device = wire_of_catalogue(exchanged_name_, scenario_);
    for (const int device : pinned_otherwise_) devices_[device].pinned = !devices_[device].pinned;
}

double Simulation::largest_flow(script::DeviceRole held) const {
    const std::optional<int> device = scenario_.index_of(held);
    const double in = inserted(held);
    if (!device || *device == 0 || in <= 0) return 0;
    const scenario::Device &outer = devices_[*device].device, &inner = devices_[*device - 1].device;
    // What is not in the body of the inner device is in the part of the outer one outside, if it is in it at
    // all.
    const double inside = wire_.devices[*device - 1].inserted, outside = outer.length - in;
    return exercise::largest_flow(outer, inner.outer_diameter,
                                  inside <= 0 ? 0 : outside + std::min(inside, in));
}

int Simulation::device_of(script::DeviceRole held) const {
    return devices_.size() == 1 || held == script::DeviceRole::All ? physics::every_device
                                                                   : *scenario_.index_of(held);
}

void Simulation::inject_through(const script::Inject& command) {
    const auto deny = [this](std::string why) { denied_ = "Nothing was injected: " + std::move(why); };
    const std::string_view name = script::name_of(command.through);
    if (inserted(command.through) <= 0) return deny(fmt::format("the {} is not inside", name));
    const double most = largest_flow(command.through);
    const int inner = *scenario_.index_of(command.through) - 1;
    if (command.rate > most)
        return deny(most < 0.1 ? fmt::format("the {} fills the {}'s lumen", devices_[inner].name(), name)
                               : fmt::format("the lumen passes {:.1f} ml/s at most", most));
    const geometry::Vec3 at = tip_of(command.through).at;
    contrast_->inject({at, command.rate, command.volume, command.iodine});
}

/// The part of a motion that the devices' lengths and the vessels allow [mm].
double Simulation::allowed_feed(const Motion& motion, StepReport& report) const {
    double most = motion.insertion;
    double still = 0, longest = 0;
    for (int k = 0; k < static_cast<int>(chain().devices.size()); ++k) {
        const physics::Device& device = chain().devices[k];
        const bool moves = motion.device == physics::every_device ? device.inserted > 0 : motion.device == k;
        (moves ? longest : still) = std::max(moves ? longest : still, device.inserted);
        if (!moves) continue;
        const double left = std::max(0.0, device.spec.length - device.inserted);
        if (most > left + 1e-9) report.whole_wire_is_in = true;
        most = std::min(most, left);
        most = std::max(most, -device.inserted);
    }
    if (const double inside = physics::least_length(chain().grid); most < 0 && still < inside) {
        const double least = std::min(0.0, inside - longest);
        if (most < least - 1e-9) report.withdrawal_stopped = true;
        most = std::max(most, least);
    }
    for (int k = 1; most > 0 && k < static_cast<int>(devices_.size()); ++k)
        if ((motion.device == physics::every_device || motion.device == k) &&
            stands_before_a_narrow_vessel(k)) {
            report.too_thick = true;
            return 0;
        }
    return std::abs(most) < 1e-12 ? 0 : most;
}

/// Whether the device's tip has come to a place that is narrower than it is, here or a segment ahead.
bool Simulation::stands_before_a_narrow_vessel(int device) const {
    const physics::Chain& chain = this->chain();
    double left = chain.devices[device].inserted;
    if (left <= 0) return false;
    int i = 1;
    for (; i < chain.segments() && left > chain.lengths[i]; ++i) left -= chain.lengths[i];
    const Vec3 tip = chain.joints[i - 1] + left * chain.tangents[i];
    const Vec3 places[] = {tip, tip + chain.grid.segment_length * chain.tangents[i]};
    physics::WallContact contacts[2];
    for (physics::WallContact& contact : contacts) contact.station = chain.stations[i];
    wall_->contacts(places, contacts);
    // The wall takes the radius of the chain's own wire off the lumen's.
    for (int k = 0; k < 2; ++k) {
        const double lumen =
            std::min(contacts[k].clearance + chain.inner_radius(), wall_->narrowest(places[k]));
        if (contacts[k].clearance > 0 && lumen < 0.5 * devices_[device].device.outer_diameter) return true;
    }
    return false;
}

/// The wire becomes another where it is out.
void Simulation::exchange_wire(Motion& motion, StepReport& report) {
    const std::string name = std::exchange(motion.exchange, {});
    if (chain().devices[0].inserted > 0) {
        report.denied = "The wire was not exchanged: it is still in; remove it first";
        return;
    }
    scenario::Device& wire = devices_[0].device = wire_of_catalogue(name, scenario_);
    exercise::exchange(chain(), 0, scenario_, wire);
    if (gives_) gives_->forget();
    outside_.grip(0, devices_, scenario_.hand_distance);
    if (twists_by_segments(nullptr)) physics::start_twists(chain(), 0);
    report.exchanged = wire.title;
    exchanged_name_ = name;
}

/// The device whose shaft outside a feed goes through: of all together the outermost one; −1 = none.
int Simulation::shaft_of(const Motion& motion) const {
    if (motion.insertion == 0 || motion.dragged) return -1;
    if (devices_.size() == 1) return 0;
    return motion.device == physics::every_device ? outside_.outermost() : motion.device;
}

int Simulation::fed_by_hand(const Motion& motion) const {
    return motion.by_hand() ? shaft_of(motion) : -1;
}

/// What the shafts outside bear during a part of a motion. On a shaft with others in it each may push with
/// what the others leave.
void Simulation::bear(const Motion& motion, double feed) {
    const int shaft = shaft_of(motion);
    const bool together = shaft >= 0 && shaft == outside_.outermost();
    const auto loads = hub_->loads();
    for (int k = 0; k < static_cast<int>(devices_.size()); ++k) {
        double most = outside_.passes_on(k);
        if (k == shaft) most = outside_.bears(k, motion.released ? 0.0 : feed);
        if (together && outside_.is_within(k) && !loads.empty())
            most = std::max(Outside::felt, outside_.bears(shaft, motion.released ? 0.0 : feed) -
                                               (outside_.push(shaft, loads) - loads[k].push));
        hub_->bear(k, most);
    }
}

/// All of a part of the hand's motion bows the shaft outside, or comes out of its bow. False when the motion
/// is finished.
bool Simulation::bow_out(Motion& motion, double feed) {
    outside_.fed(fed_by_hand(motion), feed, 0, 0, 0);
    motion.insertion -= feed;
    if (std::abs(motion.insertion) < 1e-12) motion.insertion = 0;
    return !motion.done();
}

/// What was refused is not asked for again; a push that was bows the shaft outside as far as that goes.
void Simulation::refuse(Motion& motion, const physics::HubReport& made, StepReport& report) {
    if (motion.dragged) {
        drags_.tries = most_drags;
    } else if (motion.released) {
        outside_.give_up();
    } else if (made.buckled && fed_by_hand(motion) >= 0 && motion.insertion > 0) {
        return refuse_push(motion, std::min(motion.insertion, 0.5 * moving_.grid.segment_length), report);
    } else {
        report.refused = true;
    }
    motion = {};
}

void Simulation::refuse_push(Motion& motion, double part, StepReport& report) {
    report.buckled = true;
    if (outside_.takes(fed_by_hand(motion), part)) {
        motion.insertion = motion.insertion - part < 1e-12 ? 0 : motion.insertion - part;
        return;
    }
    report.refused = true;
    motion = {};
}

/// A hand holds what it moves, and what is pinned.
void Simulation::take_in_hand(const Motion& motion) {
    if (!motion.by_hand()) return;
    for (int k = 0; k < static_cast<int>(devices_.size()); ++k)
        moving_.devices[k].held =
            devices_[k].pinned || motion.device == physics::every_device || motion.device == k;
    outside_.hold(devices_, moving_, motion.device == physics::every_device);
    if (motion.removes) outside_.let_go(motion.device);
}

std::vector<physics::HubLoad> Simulation::shaft_loads() const {
    return physics::shaft_loads(moving_, hub_->contacts(), hub_->loads());
}

/// At a rest: what friction moves that no hand holds goes along next; where all is in balance, or nothing
/// more helps, what has slipped has slipped. Once hands rest, shafts that have bowed outside feed or take
/// back.
void Simulation::balance() {
    if (drag_along() || !waiting_.empty()) return;
    const std::vector<physics::HubLoad> loads = shaft_loads();
    const std::optional<Outside::Release> next = outside_.release(moving_, loads);
    if (!next) return;
    Motion motion;
    motion.insertion = next->feed, motion.device = next->device, motion.released = true;
    push_before_ = outside_.push(shaft_of(motion), loads);
    waiting_.insert(waiting_.begin(), motion);
}

bool Simulation::drag_along() {
    if (moving_.rubs.empty()) return false;
    std::optional<physics::Drag> next;
    if (drags_.tries < most_drags) next = physics::drag(moving_, hub_->contacts(), hub_->loads(), drags_);
    if (next) {
        waiting_.insert(waiting_.begin(), {next->feed, next->turn, next->device, false, {}, true});
        return true;
    }
    drags_.restart();
    physics::follow_rubs(moving_, hub_->contacts());
    return false;
}

}  // namespace exercise
