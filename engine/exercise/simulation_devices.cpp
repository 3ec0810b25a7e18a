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

/// What a heart has moved the joints by besides vessel_shift(), each the mean over its neighbourhood.
std::vector<Vec3> Simulation::carried() const {
    constexpr double stiff = 20;  // to each side (estimate) [mm]
    const Vec3 shift = vessel_shift();
    std::vector<Vec3> own, sums{Vec3::Zero()}, mean;
    std::vector<double> along{0};
    for (std::size_t i = 0; i < wire_.joints.size(); ++i) {
        own.push_back(place_now(wire_.joints[i]) - wire_.joints[i] - shift);
        sums.push_back(sums.back() + own.back());
        if (i > 0) along.push_back(along.back() + (wire_.joints[i] - wire_.joints[i - 1]).norm());
    }
    std::size_t first = 0, last = 0;  // of the neighbourhood
    for (std::size_t i = 0; i < own.size(); ++i) {
        const double reach = std::min({stiff, along[i], along.back() - along[i]});
        while (along[i] - along[first] > reach + 1e-9) ++first;
        last = std::max(last, i);
        while (last + 1 < own.size() && along[last + 1] - along[i] <= reach + 1e-9) ++last;
        mean.push_back((sums[last + 1] - sums[first]) / static_cast<double>(last + 1 - first));
    }
    return mean;
}

geometry::Polyline Simulation::carried_path_of(script::DeviceRole held) const {
    geometry::Polyline path = path_of(held);
    if (motion_->rigid() || path.empty()) return path;
    const std::vector<Vec3> by = carried();
    for (std::size_t i = 0; i + 1 < path.size(); ++i) path[i] += by[i];
    // A device may end within a segment.
    const std::size_t end = path.size() - 1;
    if (end == 0) return path;
    const double part = std::clamp((path_of(held)[end] - wire_.joints[end - 1]).norm() /
                                       std::max(1e-12, (wire_.joints[end] - wire_.joints[end - 1]).norm()),
                                   0.0, 1.0);
    path[end] += (1 - part) * by[end - 1] + part * by[end];
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
    if (!exchanged_name_.empty())
        devices_[0].device = device_of_catalogue(script::DeviceRole::Wire, exchanged_name_, scenario_);
    if (const int which = balloon(); which >= 0 && treatment_.inflation() &&
                                     treatment_.inflation()->device != scenario_.devices[which].device.name)
        devices_[which].device =
            device_of_catalogue(script::DeviceRole::Balloon, treatment_.inflation()->device, scenario_);
    for (const int device : pinned_otherwise_) devices_[device].pinned = !devices_[device].pinned;
}

/// What is not in the body of the inner device is in the part of the outer one outside, if it is in it at
/// all.
Simulation::Bore Simulation::bore_of(int device) const {
    const double in = inserted(devices_[device].role), inside = wire_.devices[device - 1].inserted,
                 outside = devices_[device].device.length - in;
    return {devices_[device - 1].device.outer_diameter, inside <= 0 ? 0 : outside + std::min(inside, in)};
}

double Simulation::largest_flow(script::DeviceRole held) const {
    const std::optional<int> device = scenario_.index_of(held);
    if (!device || *device == 0 || inserted(held) <= 0) return 0;
    const Bore bore = bore_of(*device);
    return exercise::largest_flow(devices_[*device].device, bore.inner, bore.inside);
}

int Simulation::device_of(script::DeviceRole held) const {
    return devices_.size() == 1 || held == script::DeviceRole::All ? physics::every_device
                                                                   : *scenario_.index_of(held);
}

namespace {

/// Numbers of the lines of contrast: those of devices are their places in the list.
constexpr int introducer_line = 16, flush_line = 17;

}  // namespace

void Simulation::inject_by(const physics::DeviceSpec& tube, double inner, double inside, int line,
                           std::variant<std::string, geometry::Vec3> at, const script::Inject& command) {
    contrast_->inject({std::move(at), command.rate, command.volume, command.iodine,
                       blood::Line{line, bore_volume(tube, inner, inside), flush_flow(tube, inner, inside)}});
}

void Simulation::inject_through(const script::Inject& command) {
    const auto deny = [this](std::string why) { denied_ = "Nothing was injected: " + std::move(why); };
    const auto passes = [](double most) { return fmt::format("the lumen passes {:.1f} ml/s at most", most); };
    if (!command.branch.empty()) {
        const Standing& flush = flush_catheter_in(command.branch);
        if (const double most = exercise::largest_flow(flush.tube.spec, 0, 0); command.rate > most)
            return deny("of the flush catheter, " + passes(most));
        return inject_by(flush.tube.spec, 0, 0, flush.line, command.branch, command);
    }
    if (command.introducer) {
        const physics::DeviceSpec& sheath = standing_.front().tube.spec;
        if (const double most = largest_flow_of_introducer(); command.rate > most)
            return deny("of the introducer, " + passes(most));
        return inject_by(sheath, widest_inside(), sheath.length, introducer_line, wire_.joints[0], command);
    }
    const std::string_view name = script::name_of(command.through);
    if (inserted(command.through) <= 0) return deny(fmt::format("the {} is not inside", name));
    const double most = largest_flow(command.through);
    const int device = *scenario_.index_of(command.through);
    if (command.rate > most)
        return deny(most < 0.1 ? fmt::format("the {} fills the {}'s lumen", devices_[device - 1].name(), name)
                               : passes(most));
    const Bore bore = bore_of(device);
    inject_by(devices_[device].device, bore.inner, bore.inside, device, led_to(tip_of(command.through)),
              command);
}

double Simulation::largest_flow_of_introducer() const {
    const physics::DeviceSpec& sheath = standing_.front().tube.spec;
    return exercise::largest_flow(sheath, widest_inside(), sheath.length);
}

/// Outer diameter of the largest device in the introducer [mm].
double Simulation::widest_inside() const {
    double widest = 0;
    for (std::size_t k = 0; k < devices_.size(); ++k)
        if (wire_.devices[k].inserted > 0) widest = std::max(widest, devices_[k].device.outer_diameter);
    return widest;
}

/// The introducer, and the flush catheters of scenario and attempt.
void Simulation::stand_tubes() {
    standing_.clear();
    standing_.push_back({introducer_of(*anatomy_), introducer_line});
    const std::vector<std::string> placed = std::exchange(flushed_, {});
    if (!scenario_.entry.flush_catheter.empty()) flush_catheter_in(scenario_.entry.flush_catheter);
    for (const std::string& branch : placed) flush_catheter_in(branch);
}

const Simulation::Standing& Simulation::flush_catheter_in(const std::string& branch) {
    const std::size_t first = scenario_.entry.flush_catheter.empty() ? 1 : 2;
    if (first == 2 && standing_.size() > 1 && branch == scenario_.entry.flush_catheter) return standing_[1];
    const auto known = std::ranges::find(flushed_, branch);
    if (known != flushed_.end()) return standing_[first + static_cast<std::size_t>(known - flushed_.begin())];
    if (branch != scenario_.entry.flush_catheter) flushed_.push_back(branch);
    const blood::BloodFlow& blood = contrast_->blood();
    const blood::FlowCell& end = blood.cells[static_cast<std::size_t>(contrast_->entry_of(branch))];
    standing_.push_back({flush_catheter_to(*anatomy_, end), flush_line + static_cast<int>(standing_.size())});
    return standing_.back();
}

/// Where what leaves an end gets to: into the mouth of a branch that the end lies in or that is just ahead,
/// as from a catheter in the mouth of a coronary artery; else it mixes where the end is.
Vec3 Simulation::led_to(const Tip& tip) const {
    constexpr double ahead = 6, step = 1;  // [mm]
    constexpr double smaller = 0.5;        // radius of a branch over that of the vessel
    constexpr double mouth = 0.85;         // of the vessel's radius, from where on a branch has left it
    const blood::BloodFlow& blood = contrast_->blood();
    const blood::FlowCell& here = blood.cells[static_cast<std::size_t>(blood.nearest(tip.at))];
    for (double gone = 0; gone <= ahead; gone += step) {
        const Vec3 at = tip.at + gone * tip.along;
        for (const blood::FlowCell& cell : blood.cells)
            if (cell.branch != here.branch && cell.radius < smaller * here.radius &&
                (at - cell.centre).norm() < cell.radius &&
                (cell.centre - here.centre).norm() > mouth * here.radius)
                return cell.centre;
    }
    return tip.at;
}

/// To where devices have come.
void Simulation::lead_lines() {
    for (int device = 1; device < static_cast<int>(devices_.size()); ++device) {
        if (inserted(devices_[device].role) <= 0 || !contrast_->was_used(device)) continue;
        const Bore bore = bore_of(device);
        contrast_->lead(device, led_to(tip_of(devices_[device].role)),
                        bore_volume(devices_[device].device, bore.inner, bore.inside));
    }
}

std::vector<Simulation::Jet> Simulation::jets() const {
    std::vector<Jet> jets;
    const auto add = [&](const Tip& from, const physics::DeviceSpec& tube, int line) {
        const blood::ContrastFlow::Outflow out = contrast_->out_of_line(line);
        if (out.iodine > 0 && out.flow > 0) jets.push_back({from, tube.inner_diameter, out});
    };
    for (int device = 1; device < static_cast<int>(devices_.size()); ++device)
        if (inserted(devices_[device].role) > 0)
            add(tip_of(devices_[device].role), devices_[device].device, device);
    add({wire_.joints[0], wire_.tangents[std::min<std::size_t>(1, wire_.tangents.size() - 1)]},
        standing_.front().tube.spec, introducer_line);
    return jets;
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
    // A balloon follows its wire.
    if (const int k = balloon(); most > 0 && k >= 0 && motion.device == k) {
        const double wire = chain().devices[0].inserted - chain().devices[k].inserted;
        if (most > wire + 1e-9 && wire < 1e-9)
            report.denied = "The balloon catheter was not advanced: it has come to the end of the wire";
        most = std::min(most, std::max(0.0, wire));
    }
    for (int k = 1; most > 0 && k < static_cast<int>(devices_.size()); ++k)
        if ((motion.device == physics::every_device || motion.device == k) &&
            stands_before_a_narrow_vessel(k)) {
            report.too_thick = true;
            return 0;
        }
    return std::abs(most) < 1e-12 ? 0 : most;
}

/// Whether the device's tip, or its balloon, has come to a place that is narrower than it is, here or a
/// segment ahead.
bool Simulation::stands_before_a_narrow_vessel(int device) const {
    const physics::Chain& chain = this->chain();
    const physics::Device& placed = chain.devices[device];
    const auto stands = [&](double from_tip, double radius) {
        double left = placed.inserted - from_tip;
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
            if (contacts[k].clearance > 0 && lumen < radius) return true;
        }
        return false;
    };
    if (stands(0, 0.5 * devices_[device].device.outer_diameter)) return true;
    for (const physics::Bulge& bulge : placed.bulge)
        for (std::size_t k = 0; k < bulge.radii.size(); ++k)
            if (k == 0 || bulge.radii[k] > bulge.radii[k - 1])
                if (stands(bulge.from_tip + physics::Bulge::spacing * static_cast<double>(k), bulge.radii[k]))
                    return true;
    return false;
}

/// The wire or the balloon becomes another where it is out.
void Simulation::exchange_device(Motion& motion, StepReport& report) {
    const std::string name = std::exchange(motion.exchange, {});
    const int which = motion.device;
    scenario::PlacedDevice& placed = devices_[which];
    if (chain().devices[which].inserted > 0) {
        report.denied =
            fmt::format("The {0} was not exchanged: it is still in; remove it first", placed.name());
        return;
    }
    scenario::Device& by = placed.device = device_of_catalogue(placed.role, name, scenario_);
    exercise::exchange(chain(), which, scenario_, by);
    if (which == balloon()) {
        treatment_.take(name);
        prepare_balloon(chain());
    }
    if (gives_) gives_->forget();
    outside_.grip(which, devices_, scenario_.hand_distance);
    if (which == 0 && twists_by_segments(nullptr)) physics::start_twists(chain(), 0);
    report.exchanged = by.title;
    if (which == 0) exchanged_name_ = name;
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
