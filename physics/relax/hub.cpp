#include "physics/relax/hub.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/wall/astray.h"
#include "physics/wire/energy.h"
#include "physics/wire/rub_forces.h"

namespace physics {
namespace {

constexpr int halvings = 5;               // of a motion before it is refused
constexpr double work_fraction = 2;       // of the hand's work by the forces before and after
constexpr double energy_fraction = 0.05;  // of the wire's energy: its bends move as it does
constexpr double energy_floor = 1e-3;     // [N·mm]
constexpr double sharpest = degree * 90;  // of a joint

/// What a relaxation may take of a call's updates: a few passes are kept for what it may take beyond that,
/// and to undo it.
int work_left(const Chain& wire, int updates, const HubReport& so_far) {
    assert(wire.segments() >= 1 && so_far.relax.updates >= 0);
    const int kept = GlobalRelaxer::least_passes * wire.segments();
    return std::max(updates / 4, updates - kept) - so_far.relax.updates;
}

const RelaxerConfig& checked(const RelaxerConfig& config) {
    if (config.kind != RelaxerKind::Global) throw std::invalid_argument("a hub needs the global relaxer");
    return config;
}

}  // namespace

Hub::Hub(const RelaxerConfig& config, const LumenWall& wall) : relaxer_(checked(config), wall), wall_(wall) {}

void Hub::bear(int device, double push) {
    assert(device >= 0 && device < most_devices && push > 0);
    if (push > bears_[device] && refused_for_push_) refuses_ = false;
    bears_[device] = push;
}

void Hub::let_vessels_make_way(Chain& wire) const {
    assert(wire.vessels_stay && wall_.foundation() && !working_);
    wire.vessels_stay = false;
    if (wire.grips.empty()) start_grips(wire, true);
    LaggedYields::prepare(wire, *wall_.foundation());
}

void Hub::let_vessels_stay(Chain& wire) {
    assert(!wire.vessels_stay);
    wire.vessels_stay = true;
    for (Grip& grip : wire.grips) {
        grip.give = 0;
        grip.given = grip.along = grip.shift = Vec3::Zero();
    }
}

double Hub::passes_on(const Chain& wire, int device) const {
    assert(device >= 0 && device < static_cast<int>(wire.devices.size()));
    if (bears_[device] > 0) return bears_[device];
    const double stated = wire.devices[device].spec.buckling_force;
    return stated > 0 ? stated : std::numeric_limits<double>::infinity();
}

double Hub::energy_of(const Chain& wire) const {
    assert(relaxer_.contacts().size() == wire.joints.size());
    return total_energy(wire, relaxer_.contacts()).total();
}

/// Whether a wire can rest there after this motion from the last rest.
bool Hub::can_be(const RelaxReport& report) const {
    assert(loads_.size() == rest_loads_.size() || settling_);
    // A flat minimum is a rest, and on planes, which jump, there may be none.
    const bool rests = report.at_rest() || !wall_.smooth();
    if (!rests || report.largest_bend > sharpest) return false;
    const auto contacts = relaxer_.contacts();
    if (std::any_of(contacts.begin(), contacts.end(), astray)) return false;
    // One device may push and another pull by more than both together.
    double force = 0, torque = 0;
    for (const std::vector<HubLoad>* loads : {&loads_, &rest_loads_})
        for (const HubLoad& load : *loads) {
            force = std::max(force, std::abs(load.push));
            torque = std::max(torque, std::abs(load.torque));
        }
    const double work = force * std::abs(made_.feed) + torque * std::abs(made_.turn);
    return energy_ - rest_energy_ <=
           work_fraction * work + energy_fraction * std::abs(rest_energy_) + energy_floor;
}

/// Whether a shaft outside bows under the push of the motion that was tried. A pull gives way to anything.
bool Hub::buckles(const Chain& wire) const {
    if (settling_ || made_.feed < 0 || !loads_at_rest_) return false;
    assert(loads_.size() == wire.devices.size() && rest_loads_.size() == loads_.size());
    const std::vector<HubLoad> shafts = shaft_loads(wire, relaxer_.contacts(), loads_);
    for (int k = 0; k < static_cast<int>(loads_.size()); ++k) {
        const double push = shafts[k].push, before = rest_loads_[k].push - valves_on_hub(rest_, k);
        const bool fed = made_.device == every_device || made_.device == k;
        if (push > passes_on(wire, k) && ((fed && made_.feed > 0) || push > before)) return true;
    }
    return false;
}

/// Whether the motion is one that the wire has been found not to make from where it is.
bool Hub::refuses(const Chain& wire, const HubMotion& motion) const {
    if (!refuses_ || motion.device != refused_.device || !relaxer_.knows(wire)) return false;
    assert(!working_ && std::isfinite(refused_.feed) && std::isfinite(refused_.turn));
    const auto like = [](double asked, double refused) {
        return asked == refused || (asked * refused > 0 && std::abs(asked) <= std::abs(refused) &&
                                    std::abs(asked) >= std::ldexp(std::abs(refused), -halvings));
    };
    return like(motion.feed, refused_.feed) && like(motion.turn, refused_.turn);
}

void Hub::find_loads(const Chain& wire, const RelaxReport& report) {
    loads_at_rest_ = report.at_rest();
    loads_ = hub_loads(wire, relaxer_.contacts());
    energy_ = energy_of(wire);
    assert(loads_.size() == wire.devices.size());
}

void Hub::wall_has_changed() {
    relaxer_.forget();
    working_ = settling_ = pending_ = false;
    loads_at_rest_ = refuses_ = false;
    spent_ = 0;
}

HubReport Hub::settle(Chain& wire, int updates) {
    assert(validate(wire).empty());
    if (!relaxer_.knows(wire)) refuses_ = false;
    working_ = settling_ = true;
    pending_ = false;
    spent_ = 0;
    rest_ = wire;
    made_ = {};
    return resume(wire, updates);
}

HubReport Hub::move(Chain& wire, const HubMotion& motion, int updates) {
    assert(std::isfinite(motion.feed) && std::isfinite(motion.turn));
    const double lambda = wire.grid.segment_length;
    asked_ = {std::clamp(motion.feed, -lambda, lambda), std::clamp(motion.turn, -largest_turn, largest_turn),
              motion.device};
    if (refuses(wire, asked_)) {
        HubReport report;
        report.outcome = HubReport::Outcome::Refused;
        report.buckled = refused_for_push_;
        report.relax = relaxer_.relax(wire, {updates, 0, 0});  // as it is
        return report;
    }
    halvings_ = spent_ = 0;
    pending_ = refuses_ = false;
    rest_ = wire;
    working_ = true;
    settling_ = false;
    // Those of the chain as it was left, unless something else has changed it since.
    if (!loads_at_rest_ || !relaxer_.knows(wire)) {
        loads_ = hub_loads(wire, relaxer_.contacts());
        energy_ = energy_of(wire);
    }
    rest_loads_ = loads_;
    rest_energy_ = energy_;
    HubReport report;
    start_part(wire, updates, report);
    return finish(wire, updates, report);
}

int Hub::most_work(const Chain& wire, const HubMotion& motion) {
    constexpr int passes = 600, least = 140'000, most = 1'000'000;
    return motion.feed < 0 ? most : std::clamp(passes * wire.segments(), least, most);
}

/// Updates that the motion may have taken when the try under way ends: three quarters of all for the whole
/// motion, and for each smaller part three quarters of what is then left.
int Hub::work_of_try(const Chain& wire) const {
    if (settling_) return most_settling;
    const int whole = most_work(wire, asked_);
    assert(std::abs(asked_.feed) <= wire.grid.segment_length && std::abs(asked_.turn) <= largest_turn);
    assert(halvings_ >= 0 && halvings_ <= halvings);
    return whole - (whole >> (2 * halvings_ + 2));
}

/// One part of the motion, from the last rest.
void Hub::start_part(Chain& wire, int updates, HubReport& report) {
    const double fraction = std::ldexp(1.0, -halvings_);
    assert(working_ && fraction > 0);
    made_ = {fraction * asked_.feed, fraction * asked_.turn, asked_.device};
    pending_ = false;
    const RelaxReport part = relaxer_.move(
        wire, made_, {std::min(work_left(wire, updates, report), work_of_try(wire) - spent_), 0, 0});
    spent_ += part.updates;
    report.relax.add(part);
}

HubReport Hub::resume(Chain& wire, int updates) {
    HubReport report;
    assert(working_);
    if (pending_) {
        start_part(wire, updates, report);
    } else {
        const RelaxReport part = relaxer_.relax(
            wire, {std::min(work_left(wire, updates, report), work_of_try(wire) - spent_), 0, 0});
        spent_ += part.updates;
        report.relax.add(part);
    }
    return finish(wire, updates, report);
}

/// After a relaxation: at rest, out of budget, or to be tried again in halves.
HubReport Hub::finish(Chain& wire, int updates, HubReport report) {
    for (;;) {
        assert(working_ && spent_ >= 0);
        // Once a try's work has been spent, less is left of it than the relaxer needs to do anything.
        const int needed = GlobalRelaxer::least_passes * wire.segments();
        if (report.relax.out_of_budget() && work_of_try(wire) - spent_ > needed) {
            loads_at_rest_ = false;
            report.outcome = HubReport::Outcome::Working;
            return report;
        }
        find_loads(wire, report.relax);
        const bool buckles = this->buckles(wire);
        report.buckled = report.buckled || buckles;
        if (settling_ || (!buckles && can_be(report.relax))) {
            working_ = settling_ = false;
            report.made = made_;
            return report;
        }
        wire = rest_;
        made_ = {};
        report.relax.add(relaxer_.recall(wire));
        if (++halvings_ > halvings) {
            working_ = false;
            refuses_ = true;
            refused_ = asked_;
            refused_for_push_ = report.buckled;
            report.outcome = HubReport::Outcome::Refused;
            assert(made_.feed == 0 && made_.turn == 0 && validate(wire).empty());
            find_loads(wire, report.relax);
            return report;
        }
        if (updates - report.relax.updates < least_updates(wire) && report.relax.updates > 0) {
            pending_ = true;
            loads_at_rest_ = false;
            report.outcome = HubReport::Outcome::Working;
            return report;
        }
        start_part(wire, updates, report);
    }
}

}  // namespace physics
