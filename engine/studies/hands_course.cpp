#include "engine/studies/hands_course.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "physics/wire/energy.h"

namespace studies {
namespace {

constexpr double explained = 0.01;     // fraction of a step's work
constexpr double least_energy = 1e-4;  // below this nothing is made again [N·mm]
constexpr int parts_of_a_step = 8;
constexpr double whole_jump = 0.5;  // fraction of what was missing that one part must have

/// Turn of the material at the distal end against the hub's at the start, unwound [rad].
double distal_roll(const physics::Device& device) {
    return device.roll + (device.wound.empty() ? 0.0 : device.wound.back());
}

double energy_of(const exercise::Simulation& simulation) {
    return physics::total_energy(simulation.wire(), simulation.contacts()).total();
}

double loss_of(const exercise::Simulation& simulation) {
    return simulation.wire().friction_loss + simulation.wire().rub_loss + simulation.model_changes().released;
}

/// What the hands did from one rest to the next, by the mean of the loads.
double work_between(const HandSample& before, const HandSample& after) {
    double work = 0;
    for (std::size_t k = 0; k < after.devices.size(); ++k) {
        const HandReading &a = before.devices[k], &b = after.devices[k];
        work += 0.5 * ((a.push + b.push) * (b.inserted - a.inserted) +
                       (a.torque + b.torque) * (b.turned - a.turned));
    }
    return work;
}

}  // namespace

double HandBalance::error() const {
    const double larger = std::max({std::abs(work), std::abs(stored + friction + jumps), 0.1 * exchanged});
    return larger > 0 ? std::abs(missing()) / larger : 0.0;
}

HandCourse::HandCourse(const StudyOptions& options, const HandScene& scene) {
    scenario::Scenario s =
        scenario::load_scenario(options.scenarios / (scene.scenario + ".toml"), options.devices, scene.with);
    // The model's sizes are those of vessels that make way, even where that does not show.
    if (!s.tube && !s.tissue.rigid) s.tissue.rigid = false;
    simulation_ = std::make_unique<exercise::Simulation>(s, options.cache);
    simulation_->step();  // at rest, with loads
    energy_ = energy_of(*simulation_);
    friction_ = loss_of(*simulation_);
    for (const physics::Device& device : simulation_->wire().devices) rolled_.push_back(distal_roll(device));
    samples_.push_back(read());
}

std::size_t HandCourse::at(script::DeviceRole held) const {
    const auto devices = simulation_->devices();
    const auto found = std::find_if(devices.begin(), devices.end(),
                                    [&](const scenario::PlacedDevice& d) { return d.role == held; });
    return found == devices.end() ? 0 : static_cast<std::size_t>(found - devices.begin());
}

HandSample HandCourse::read() const {
    const exercise::Simulation& s = *simulation_;
    HandSample sample;
    const auto& hands = s.readings().hands;
    for (std::size_t k = 0; k < hands.size(); ++k) {
        const physics::Device& device = s.wire().devices[k];
        const exercise::Simulation::Tip tip = s.tip_of(s.devices()[k].role);
        sample.devices.push_back({device.inserted, hands[k].turned, distal_roll(device) - rolled_[k],
                                  hands[k].load.push, hands[k].load.torque, tip.at, tip.along});
    }
    sample.stored = energy_of(s) - energy_;
    sample.friction = loss_of(s) - friction_;
    sample.vessel_moved = s.farthest_vessel_move();
    for (const physics::WallContact& c : s.contacts())
        sample.contact_force = std::max(sample.contact_force, c.force());
    if (!samples_.empty()) sample.jumps = last().jumps, sample.work = last().work;
    sample.chapter = chapter_;
    return sample;
}

double HandCourse::unexplained(const HandSample& before, const HandSample& after) const {
    return after.work - before.work - (after.stored - before.stored) - (after.friction - before.friction);
}

HandSample HandCourse::moved(const HandSample& from, const script::Command& command) {
    simulation_->apply(command);
    HandSample sample = from;
    bool buckled = false, refused = false;
    for (int frame = 0; frame < most_frames; ++frame) {
        const exercise::StepReport report = simulation_->step();
        buckled |= report.buckled, refused |= report.refused && !report.buckled;
        HandSample next = read();
        next.work = sample.work + work_between(sample, next);
        sample = std::move(next);
        if (!report.settling && report.waiting_insertion == 0 && report.waiting_rotation == 0) break;
    }
    sample.buckled = buckled, sample.refused = refused, sample.jumped = false;
    return sample;
}

void HandCourse::take(HandSample sample) {
    // Frames are kept within a turn.
    for (std::size_t k = 0; k < sample.devices.size(); ++k) {
        double& roll = sample.devices[k].tip_roll;
        roll +=
            2 * std::numbers::pi * std::round((last().devices[k].tip_roll - roll) / (2 * std::numbers::pi));
    }
    exchanged_ += std::abs(sample.work - last().work);
    ++steps_;
    jumping_steps_ += sample.jumped;
    samples_.push_back(std::move(sample));
}

/// The step again in parts, from the state before it. Keeps them only where they leave less unexplained than
/// the whole step did; else everything is as before.
bool HandCourse::go_in_parts(const exercise::Simulation& before, const script::Command& part,
                             double missing) {
    auto whole = std::exchange(simulation_, std::make_unique<exercise::Simulation>(before));
    std::vector<HandSample> parts = {last()};
    double left = 0;
    for (int k = 0; k < parts_of_a_step; ++k) {
        HandSample one = moved(parts.back(), part);
        one.jumps = parts.back().jumps;
        const double lost = unexplained(parts.back(), one);
        one.jumped = lost > whole_jump * missing && lost > least_energy;
        (one.jumped ? one.jumps : left) += lost;
        parts.push_back(std::move(one));
    }
    if (std::abs(left) >= std::abs(missing)) {
        simulation_ = std::move(whole);
        return false;
    }
    for (std::size_t k = 1; k < parts.size(); ++k) take(std::move(parts[k]));
    return true;
}

bool HandCourse::go(const std::function<script::Command(double)>& command, double amount, double step,
                    const std::function<bool()>& until) {
    const int steps = std::max(1, static_cast<int>(std::lround(std::abs(amount) / step)));
    for (int k = 0; k < steps; ++k) {
        const exercise::Simulation before(*simulation_);
        const HandSample after = moved(last(), command(amount / steps));
        const double missing = unexplained(last(), after), work = std::abs(after.work - last().work);
        if (std::abs(missing) <= explained * work + least_energy ||
            !go_in_parts(before, command(amount / steps / parts_of_a_step), missing))
            take(after);
        if (until && until()) return true;
    }
    return false;
}

bool HandCourse::feed(double mm, script::DeviceRole held, const std::function<bool()>& until) {
    const auto command = [held](double by) -> script::Command {
        if (by < 0) return script::Withdraw{-by, held};
        return script::Advance{by, held};
    };
    return go(command, mm, feed_step, until);
}

bool HandCourse::turn(double rad, script::DeviceRole held, const std::function<bool()>& until) {
    return go(
        [held](double by) -> script::Command {
            return script::Rotate{by, held};
        },
        rad, turn_step, until);
}

void HandCourse::hold(int frames) {
    for (int k = 0; k < frames; ++k) {
        simulation_->step();
        HandSample sample = read();
        sample.work += work_between(last(), sample);
        take(std::move(sample));
    }
}

HandBalance HandCourse::balance() const {
    const HandSample& end = last();
    return {end.work, end.stored, end.friction, end.jumps, exchanged_, steps_, jumping_steps_};
}

}  // namespace studies
