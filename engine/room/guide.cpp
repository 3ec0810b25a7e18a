#include "engine/room/guide.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <fmt/format.h>

#include "engine/exercise/monitor.h"
#include "engine/io/text.h"

namespace room {
namespace {

using script::practice;

bool pressed(const Input& input, Action action) {
    return std::ranges::find(input.pressed, action) != input.pressed.end();
}

/// Of the devices that the hand held before and after, the one that went or turned farthest.
struct Motion {
    double push = 0, turn = 0;
};
Motion motion_of(Side side, const Situation& before, const Situation& after) {
    const auto at = static_cast<std::size_t>(side);
    Motion made;
    if (!before.held[at] || before.held[at] != after.held[at]) return made;
    for (std::size_t k = 0; k < std::min(before.devices.size(), after.devices.size()); ++k) {
        const Situation::Device &was = before.devices[k], &is = after.devices[k];
        if (after.held[at] != script::DeviceRole::All && after.held[at] != is.role) continue;
        const double push = is.inserted - was.inserted, turn = is.turned - was.turned;
        if (std::abs(push) > std::abs(made.push)) made.push = push;
        if (std::abs(turn) > std::abs(made.turn)) made.turn = turn;
    }
    return made;
}

/// Adds a change to the action of its sign.
void add(Effects& effects, Action more, Action less, double change) {
    effects[practice(change > 0 ? more : less)] += std::abs(change);
}
/// The same, as one time where it is more than rounding.
void add_once(Effects& effects, Action more, Action less, double change) {
    if (std::abs(change) > 1e-6) effects[practice(change > 0 ? more : less)] += 1;
}

void of_hands(Effects& effects, const Situation& before, const Situation& after, const Input& input) {
    double farthest = 0;
    for (const Side side : sides) {
        const Motion made = motion_of(side, before, after);
        const auto& actions_of = actions_of_hands[static_cast<std::size_t>(side)];
        add(effects, actions_of[0], actions_of[1], made.push);
        add(effects, actions_of[3], actions_of[2], made.turn);
        farthest = std::max(farthest, std::abs(made.push));
        const auto at = static_cast<std::size_t>(side);
        if (pressed(input, actions_of[4]) && before.held[at] != after.held[at])
            effects[practice(actions_of[4])] += 1;
    }
    if (input.holds(Action::Fine)) effects[practice(Action::Fine)] += farthest;
    if (input.holds(Action::Fast)) effects[practice(Action::Fast)] += farthest;
    if (pressed(input, Action::Helper) && (before.helper != after.helper || before.held != after.held))
        effects[practice(Action::Helper)] += 1;
    for (std::size_t k = 0; k < std::min(before.devices.size(), after.devices.size()); ++k)
        if (before.devices[k].grip && after.devices[k].grip)
            add_once(effects, Action::GripFarther, Action::GripCloser,
                     *after.devices[k].grip - *before.devices[k].grip);
}

void of_stand(Effects& effects, const Situation& before, const Situation& after) {
    add(effects, Action::ArmLao, Action::ArmRao, after.arm.lao - before.arm.lao);
    add(effects, Action::ArmCranial, Action::ArmCaudal, after.arm.cranial - before.arm.cranial);
    const geometry::Vec3 table = after.table - before.table;
    add(effects, Action::TableLeft, Action::TableRight, table.x());
    add(effects, Action::TableDown, Action::TableUp, table.y());
    add(effects, Action::TableHead, Action::TableFeet, table.z());
    add_once(effects, Action::SidMore, Action::SidLess, after.arm.sid - before.arm.sid);
    const double wider = after.arm.detector_width - before.arm.detector_width;
    add_once(effects, Action::Widen, Action::Magnify, wider);
    // A smaller field cuts the opening too, which is no collimation.
    if (wider == 0)
        add_once(effects, Action::Uncollimate, Action::Collimate,
                 after.arm.opening_width - before.arm.opening_width);
    add_once(effects, Action::WedgeOut, Action::WedgeIn, after.arm.wedge.edge - before.arm.wedge.edge);
    const auto turned = [](const render::BeamFilter& a, const render::BeamFilter& b) {
        return a.is_in() && b.is_in() && a.angle != b.angle;
    };
    if (turned(before.arm.wedge, after.arm.wedge) || turned(before.arm.lung_shutter, after.arm.lung_shutter))
        effects[practice(Action::WedgeTurn)] += 1;
    if (before.arm.lung_shutter.is_in() != after.arm.lung_shutter.is_in())
        effects[practice(Action::LungShutter)] += 1;
    add_once(effects, Action::PulsesMore, Action::PulsesFewer, after.pulse_rate - before.pulse_rate);
}

void of_pedals(Effects& effects, const Situation& before, const exercise::Frame& frame) {
    const exercise::ConsoleEvents& events = frame.motion.console;
    if (events.reference && (!frame.monitor || frame.monitor->reference()))
        effects[practice(Action::Reference)] += 1;
    if (!events.pulse) return;
    const script::ImagingMode mode = frame.simulation.console().mode();
    effects[practice(script::acquires(mode) ? Action::Acquisition : Action::Fluoroscopy)] += 1;
    if (script::acquires(mode) && mode != frame.simulation.scenario().imaging.acquisition)
        effects[practice(Action::AcquisitionMode)] += 1;
    if (mode == script::ImagingMode::Roadmap && !(frame.monitor && frame.monitor->map_is_missing()))
        effects[practice(Action::Roadmap)] += 1;
    // The pedal takes one by itself when it goes down.
    if (events.mask && before.acquires) effects[practice(Action::Mask)] += 1;
}

void of_shifts(Effects& effects, const Input& input, const exercise::Frame& frame) {
    for (const exercise::MaskShift& shift : frame.mask_shifts) {
        if (shift.outcome != exercise::MaskShift::Outcome::Shifted) continue;
        for (const Action action : {Action::ShiftLeft, Action::ShiftRight, Action::ShiftUp, Action::ShiftDown,
                                    Action::ShiftAuto, Action::ShiftOff})
            if (pressed(input, action) && shift.automatic == (action == Action::ShiftAuto))
                effects[practice(action)] += 1;
    }
}

void of_contrast(Effects& effects, const Input& input, const exercise::Frame& frame, const KeyMap& keys) {
    const bool given = std::ranges::any_of(frame.commands, [](const script::Command& command) {
        return std::holds_alternative<script::Inject>(command);
    });
    if (!given || input.injections.empty()) return;
    const auto by = keys.injections.at(static_cast<std::size_t>(input.injections.front())).by;
    effects[by == InjectionPreset::By::Hand ? script::inject_by_hand : script::inject_by_pump] += 1;
}

void of_balloon(Effects& effects, const Situation& before, const Situation& after, const Input& input) {
    if (!before.balloon || !after.balloon) return;
    const Situation::Balloon &was = *before.balloon, &is = *after.balloon;
    if (is.device != was.device) {
        effects[practice(Action::NextBalloon)] += 1;
        return;
    }
    if (input.holds(Action::Inflate))
        effects[practice(Action::Inflate)] += std::max(0.0, is.wanted - was.wanted);
    if (is.wanted == 0 && was.wanted > 0) effects[practice(Action::Deflate)] += 1;
    if ((is.deployed && !was.deployed) || is.to_uncover > was.to_uncover)
        effects[practice(Action::Deploy)] += 1;
}

/// What the mouse does of it, and a gamepad's stick.
std::string other_inputs(Action action, const KeyMap& keys) {
    for (const Side side : sides) {
        const auto& of_hand = actions_of_hands[static_cast<std::size_t>(side)];
        constexpr std::array<const char*, 4> drags = {"wheel, or drag up on the image",
                                                      "wheel, or drag down on the image",
                                                      "drag left on the image", "drag right on the image"};
        constexpr std::array<const char*, 4> sticks = {"up", "down", "left", "right"};
        for (std::size_t k = 0; k < drags.size(); ++k)
            if (of_hand[k] == action)
                return fmt::format("{}{} stick {}",
                                   side == keys.mouse ? fmt::format("mouse: {}; ", drags[k]) : "",
                                   name_of(side), sticks[k]);
    }
    if (action >= Action::ArmLao && action <= Action::ArmCaudal) return "mouse: drag the C-arm's picture";
    if (action >= Action::TableHead && action <= Action::TableRight)
        return "mouse: drag the image with the right button";
    return "";
}

}  // namespace

double enough(Practice practised) {
    constexpr double degree = geometry::degree;
    if (practised >= actions) return 1;
    switch (const auto action = static_cast<Action>(practised)) {
        case Action::Advance:
        case Action::Withdraw:
        case Action::LeftAdvance:
        case Action::LeftWithdraw:
        case Action::Fast:
            return 5;  // [mm]
        case Action::Fine:
            return 1;  // [mm]
        case Action::Fluoroscopy:
            return 8;  // pulses
        case Action::Acquisition:
        case Action::AcquisitionMode:
        case Action::Roadmap:
            return 4;  // pulses
        case Action::Inflate:
            return 2;  // [atm]
        default:
            if (moves_device(action)) return 20 * degree;
            if (action >= Action::ArmLao && action <= Action::ArmCaudal) return 4 * degree;
            if (action >= Action::TableHead && action <= Action::TableDown) return 10;  // [mm]
            return 1;
    }
}

Situation situation_of(const exercise::Simulation& simulation, const Grasp* grasp) {
    Situation now;
    if (grasp) {
        for (const Side side : sides) now.held[static_cast<std::size_t>(side)] = grasp->in(side);
        now.helper = grasp->helper_text();
    }
    for (const scenario::PlacedDevice& device : simulation.devices())
        now.devices.push_back({device.role, simulation.inserted(device.role),
                               simulation.hand(device.role).turned, simulation.gripped_at(device.role)});
    const exercise::Console& console = simulation.console();
    now.arm = console.arm();
    now.table = console.table();
    now.pulse_rate = console.pulse_rate();
    now.acquires = console.beam_on() && console.mode() == script::ImagingMode::Dsa;
    if (const exercise::Inflation* balloon = simulation.treatment().inflation())
        now.balloon = {balloon->device, balloon->wanted, balloon->to_uncover, balloon->deployed};
    using State = scenario::Breathing::State;
    const State state = simulation.breathing().state();
    now.breathes = state == State::Free || state == State::Gasping;
    return now;
}

Effects effects_of(const Situation& before, const Situation& after, const Input& input,
                   const exercise::Frame& frame, const KeyMap& keys, bool completed) {
    Effects effects{};
    if (frame.motion.reset) {
        effects[practice(Action::BackToStart)] = 1;
        return effects;
    }
    of_hands(effects, before, after, input);
    of_stand(effects, before, after);
    of_pedals(effects, before, frame);
    of_shifts(effects, input, frame);
    of_contrast(effects, input, frame, keys);
    of_balloon(effects, before, after, input);
    if (before.breathes && !after.breathes) effects[practice(Action::Breath)] = 1;
    if (completed) effects[script::reach_target] = 1;
    return effects;
}

std::string inputs_of(Practice practised, const KeyMap& keys) {
    if (practised < actions) {
        const auto action = static_cast<Action>(practised);
        const std::string other = other_inputs(action, keys);
        return keys.text(action) + (other.empty() ? "" : "; " + other);
    }
    if (practised == script::reach_target) return "";
    const auto by =
        practised == script::inject_by_hand ? InjectionPreset::By::Hand : InjectionPreset::By::Pump;
    std::vector<std::string> labels;
    for (const InjectionPreset& preset : keys.injections)
        if (preset.by == by) labels.push_back(keys.label(preset.key));
    return labels.empty() ? "no key" : io::joined(labels);
}

Guide::Guide(std::vector<scenario::LessonStep> steps)
    : steps_(std::move(steps)), skipped_(steps_.size(), false) {
    for (const scenario::LessonStep& step : steps_) amounts_.emplace_back(step.practise.size(), 0.0);
}

void Guide::count(const Effects& effects) {
    const std::size_t now = shown();
    for (std::size_t k = 0; k < steps_.size(); ++k) {
        if (k != now && !is_skipped(k)) continue;
        for (std::size_t p = 0; p < amounts_[k].size(); ++p) amounts_[k][p] += effects[steps_[k].practise[p]];
    }
}

void Guide::did(Action action) {
    Effects effects{};
    effects[practice(action)] = enough(practice(action));
    count(effects);
}

void Guide::skip() {
    if (!over()) skipped_[shown()] = true;
}

std::size_t Guide::shown() const {
    std::size_t k = 0;
    while (k < steps_.size() && (skipped_[k] || is_done(k))) ++k;
    return k;
}

bool Guide::is_done(std::size_t step) const {
    assert(step < steps_.size());
    for (std::size_t p = 0; p < amounts_[step].size(); ++p)
        if (!is_done(step, p)) return false;
    return true;
}

int Guide::done() const {
    int count = 0;
    for (std::size_t k = 0; k < steps_.size(); ++k) count += is_done(k);
    return count;
}

int Guide::skipped() const {
    int count = 0;
    for (std::size_t k = 0; k < steps_.size(); ++k) count += is_skipped(k);
    return count;
}

}  // namespace room
