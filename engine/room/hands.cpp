#include "engine/room/hands.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/room/grasp.h"
#include "render/xray/c_arm.h"

namespace room {
namespace {

constexpr double smallest_motion = 1e-6;  // [mm], [rad]
constexpr double atm_step = 1;            // of a press [atm]
constexpr double sheath_step = 2;         // of a press [mm]
constexpr double repeat_time = 0.5;       // by which the handle and the sheath follow (Treatment) [s]
constexpr double at_valve = 20;           // what is still inside of a device that is taken out at once [mm]

int speed_of(const Input& input) {
    return input.holds(Action::Fine) ? 0 : input.holds(Action::Fast) ? 2 : 1;
}

double direction(const Input& input, Action positive, Action negative) {
    return (input.holds(positive) ? 1.0 : 0.0) - (input.holds(negative) ? 1.0 : 0.0);
}

double beyond(double axis, double dead_zone) {
    const double size = std::min(1.0, std::abs(axis));
    return size <= dead_zone ? 0 : std::copysign((size - dead_zone) / (1 - dead_zone), axis);
}

void warn(Messages& messages, std::string text) {
    messages.push_back({std::move(text), render::Notice::Warning});
}

/// Keeps recordings readable.
double rounded(double value, double step) {
    return std::round(value / step) * step;
}

std::size_t index_of(double rate) {
    const auto& rates = script::pulse_rates;
    return static_cast<std::size_t>(std::ranges::find(rates, rate) - rates.begin());
}

}  // namespace

void Input::add(const Input& later) {
    held |= later.held;
    pressed.insert(pressed.end(), later.pressed.begin(), later.pressed.end());
    injections.insert(injections.end(), later.injections.begin(), later.injections.end());
    wheel += later.wheel;
    drag_up += later.drag_up;
    drag_right += later.drag_right;
    push = later.push;
    turn = later.turn;
    arm_lao += later.arm_lao;
    arm_cranial += later.arm_cranial;
    table_left += later.table_left;
    table_head += later.table_head;
}

Hands::Hands(KeyMap keys, double frame_time) : keys_(std::move(keys)), frame_time_(frame_time) {}

void Hands::rest() {
    hands_ = {};
    inflates_ = deploys_ = {};
}

/// Mean fraction of its full speed over the frame.
double Hands::run_up(bool held, double& since) const {
    if (!held) {
        since = 0;
        return 0;
    }
    const double middle = since + frame_time_ / 2, whole = keys_.speeds.run_up;
    since += frame_time_;
    return whole <= 0 ? 1
                      : std::min(1.0, Speeds::first_fraction + (1 - Speeds::first_fraction) * middle / whole);
}

bool Hands::is_due(bool held, Repeated& key) const {
    key.left = key.held && held ? key.left - frame_time_ : 0;
    key.held = held;
    if (!held || key.left > 1e-9) return false;
    key.left += repeat_time;
    return true;
}

/// What the hand pushes and turns its device by in this frame [mm], [rad].
std::pair<double, double> Hands::motion(Side side, const Input& input) {
    const Speeds& s = keys_.speeds;
    const auto at = static_cast<std::size_t>(side);
    const int speed = speed_of(input);
    const auto& keys = actions_of_hands[at];
    const double push_key = direction(input, keys[0], keys[1]), turn_key = direction(input, keys[3], keys[2]);
    const double push_axis = beyond(input.push[at], s.dead_zone),
                 turn_axis = beyond(input.turn[at], s.dead_zone);
    double push = push_key * run_up(push_key != 0, hands_[at].push_since) + push_axis * std::abs(push_axis);
    double turn = turn_key * run_up(turn_key != 0, hands_[at].turn_since) + turn_axis * std::abs(turn_axis);
    push *= s.advance[speed] * frame_time_;
    turn *= s.rotate[speed] * frame_time_;
    if (side != keys_.mouse) return {push, turn};
    return {push + input.wheel * s.wheel + input.drag_up * s.drag_advance,
            turn + input.drag_right * s.drag_rotate};
}

void Hands::move_device(Side side, const Input& input, const exercise::StepReport& last,
                        std::vector<script::Command>& commands, Messages& messages) {
    auto [push, turn] = motion(side, input);
    const std::optional<script::DeviceRole> held = grasp_->in(side);
    if (!held) {
        if (push != 0 || turn != 0)
            warn(messages,
                 fmt::format("The {} hand is empty: {}", name_of(side),
                             grasp_->devices() == 1
                                 ? "this exercise has one device"
                                 : keys_.first(actions_of_hands[static_cast<std::size_t>(side)][4]) +
                                       " takes a device"));
        return;
    }
    if (last.waiting_insertion > Speeds::most_behind) push = 0;
    if (last.waiting_rotation > Speeds::most_behind_in_turn) turn = 0;
    push = rounded(std::clamp(push, -script::largest_motion, script::largest_motion), 1e-3);
    turn = std::clamp(rounded(turn / geometry::degree, 1e-2), -script::largest_rotation,
                      script::largest_rotation);
    if (std::abs(push) > smallest_motion)
        commands.push_back(push > 0 ? script::Command(script::Advance{push, *held})
                                    : script::Command(script::Withdraw{-push, *held}));
    if (std::abs(turn) > smallest_motion) commands.push_back(script::Rotate{turn * geometry::degree, *held});
}

void Hands::press_pedals(const Input& input, const exercise::Simulation& simulation,
                         std::vector<script::Command>& commands, Messages& messages) {
    using script::ImagingMode;
    const exercise::Console& console = simulation.console();
    ImagingMode acquisition = acquisition_.value_or(simulation.scenario().imaging.acquisition);
    for (const Action action : input.pressed) {
        if (action == Action::Roadmap) wants_roadmap_ = !wants_roadmap_;
        if (action == Action::AcquisitionMode) {
            acquisition_ = acquisition == ImagingMode::Dsa ? ImagingMode::Cine : ImagingMode::Dsa;
            acquisition = *acquisition_;
            messages.push_back({fmt::format("The acquisition pedal takes {}", script::title_of(acquisition)),
                                render::Notice::Info});
        }
        if (action == Action::Mask) commands.push_back(script::NewMask{});
        change_grasp(action, simulation, messages);
        if (action == Action::Reference) commands.push_back(script::StoreReference{});
        if (action == Action::Breath) {
            using State = scenario::Breathing::State;
            const State now = simulation.breathing().state();
            commands.push_back(script::Breathe{now == State::Free || now == State::Gasping});
        }
    }
    shift_mask(input, commands);
    const bool acquire = input.holds(Action::Acquisition);
    const bool beam = acquire || input.holds(Action::Fluoroscopy);
    const ImagingMode mode = acquire          ? acquisition
                             : wants_roadmap_ ? ImagingMode::Roadmap
                                              : ImagingMode::Live;
    // The image on the screen stays as it was taken while no pedal is down.
    if (beam && mode != console.mode()) commands.push_back(script::SetMode{mode});
    if (acquire && !acquires_ && mode == ImagingMode::Dsa) commands.push_back(script::NewMask{});
    acquires_ = acquire;
    if (beam != console.beam_on()) commands.push_back(script::Beam{beam});
}

void Hands::change_grasp(Action action, const exercise::Simulation& simulation, Messages& messages) {
    std::string problem;
    if (action == Action::Helper)
        problem = grasp_->call_helper(simulation);
    else if (action == Action::Device || action == Action::LeftDevice)
        grasp_->take_next(action == Action::Device ? Side::Right : Side::Left);
    else
        return;
    if (action != Action::Helper && grasp_->devices() == 1)
        problem = "This exercise has one device: the wire";
    if (problem.empty())
        messages.push_back({grasp_->sentence(), render::Notice::Info});
    else
        warn(messages, std::move(problem));
}

/// All presses of a frame are one step, of each device in the right hand. It stops where the command's range
/// ends.
void Hands::move_grip(const Input& input, const exercise::Simulation& simulation,
                      std::vector<script::Command>& commands, Messages& messages) const {
    double step = 0;
    for (const Action action : input.pressed)
        step += keys_.speeds.grip_step * ((action == Action::GripFarther) - (action == Action::GripCloser));
    if (step == 0) return;
    const std::optional<script::DeviceRole> held = grasp_->in(Side::Right);
    if (!held) warn(messages, "The right hand is empty: it has no distance from a valve");
    for (const scenario::PlacedDevice& device : simulation.devices()) {
        if (held != script::DeviceRole::All && held != device.role) continue;
        const std::optional<double> now = simulation.gripped_at(device.role);
        if (!now) {
            warn(messages, "The hand's distance counts with the method \"global\" only");
            return;
        }
        const double at = rounded(std::clamp(*now + step, script::least_grip, script::largest_grip), 1e-3);
        if (at != *now)
            commands.push_back(script::Grip{at, device.role});
        else
            warn(messages, fmt::format("The hand on the {} goes no {} than {:g} mm from the valve",
                                       device.name(), step < 0 ? "closer" : "farther", at));
    }
}

/// All presses of a frame are one shift, in their order.
void Hands::shift_mask(const Input& input, std::vector<script::Command>& commands) const {
    using Mode = script::ShiftMask::Mode;
    const double step = keys_.speeds.shift[speed_of(input)];
    script::ShiftMask by{Mode::By, 0, 0};
    const auto flush = [&] {
        if (by.x != 0 || by.y != 0) commands.push_back(by);
        by.x = by.y = 0;
    };
    for (const Action action : input.pressed) {
        if (action == Action::ShiftAuto || action == Action::ShiftOff) {
            flush();
            commands.push_back(script::ShiftMask{action == Action::ShiftAuto ? Mode::Auto : Mode::To, 0, 0});
        }
        by.x += step * ((action == Action::ShiftRight) - (action == Action::ShiftLeft));
        by.y += step * ((action == Action::ShiftDown) - (action == Action::ShiftUp));
    }
    flush();
}

void Hands::move_stand(const Input& input, const exercise::Simulation& simulation,
                       std::vector<script::Command>& commands, Messages& messages) {
    const Speeds& s = keys_.speeds;
    const exercise::Console& console = simulation.console();
    const render::CArm arm = console.arm();
    script::MoveArm move;
    const double lao = direction(input, Action::ArmLao, Action::ArmRao) * s.arm * frame_time_ + input.arm_lao;
    const double cranial =
        direction(input, Action::ArmCranial, Action::ArmCaudal) * s.arm * frame_time_ + input.arm_cranial;
    if (lao != 0) move.lao = arm.lao + lao;
    if (cranial != 0) move.cranial = arm.cranial + cranial;
    std::optional<script::Collimate> collimate;
    double rate = console.pulse_rate();
    render::BeamFilter wedge = arm.wedge, lung = arm.lung_shutter;
    for (const Action action : input.pressed) {
        const double sid = move.sid.value_or(arm.sid),
                     field = move.detector_width.value_or(arm.detector_width);
        const double opening = collimate ? collimate->width : std::min(arm.opening_width, field);
        const std::size_t index = index_of(rate);
        switch (action) {
            case Action::SidLess:
                move.sid = sid - s.sid_step;
                break;
            case Action::SidMore:
                move.sid = sid + s.sid_step;
                break;
            case Action::Magnify:
                for (const double next : s.fields)
                    if (next < field - 1e-9) {
                        move.detector_width = next;
                        break;
                    }
                break;
            case Action::Widen:
                for (auto next = s.fields.rbegin(); next != s.fields.rend(); ++next)
                    if (*next > field + 1e-9) {
                        move.detector_width = *next;
                        break;
                    }
                break;
            case Action::Collimate: {
                const double side = std::max(20.0, std::round(opening - 0.1 * field));
                collimate = script::Collimate{side, side};
                break;
            }
            case Action::Uncollimate: {
                const double side = std::round(opening + 0.1 * field);
                collimate = side >= field ? script::Collimate{script::widest_opening, script::widest_opening}
                                          : script::Collimate{side, side};
                break;
            }
            case Action::WedgeIn:
                wedge.edge = std::max((wedge.is_in() ? wedge.edge : 0.5 * field) - std::round(0.1 * field),
                                      -0.5 * field);
                break;
            case Action::WedgeOut:
                wedge.edge += std::round(0.1 * field);
                if (wedge.edge >= 0.5 * field) wedge.edge = script::widest_opening;
                break;
            case Action::WedgeTurn:
                if (render::BeamFilter& turned = wedge.is_in() ? wedge : lung; turned.is_in())
                    turned.angle =
                        std::remainder(turned.angle + 30 * geometry::degree, 360 * geometry::degree);
                else
                    warn(messages, "Wedge filter and lung shutter are out: nothing to turn.");
                break;
            case Action::LungShutter:
                // Beside the heart, over the left lung.
                lung = lung.is_in() ? render::BeamFilter()
                                    : render::BeamFilter{std::round(0.15 * field), 30 * geometry::degree};
                break;
            case Action::PulsesMore:
                if (index + 1 < script::pulse_rates.size()) rate = script::pulse_rates[index + 1];
                break;
            case Action::PulsesFewer:
                if (index > 0 && index < script::pulse_rates.size()) rate = script::pulse_rates[index - 1];
                break;
            default:
                break;
        }
    }
    if (move.lao || move.cranial || move.sid || move.detector_width) {
        const auto problems = render::problems(script::moved(arm, move));
        if (problems.empty())
            commands.push_back(move);
        else
            warn(messages, "The C-arm goes no further: " + problems.front());
    }
    if (collimate) commands.push_back(*collimate);
    if (wedge != arm.wedge) commands.push_back(script::SetFilter{script::FilterKind::Wedge, wedge});
    if (lung != arm.lung_shutter) commands.push_back(script::SetFilter{script::FilterKind::Lung, lung});
    if (rate != console.pulse_rate()) {
        if (rate > simulation.scenario().frame_rate)
            warn(messages, script::too_many_pulses(rate, simulation.scenario().frame_rate));
        else
            commands.push_back(script::SetPulseRate{rate});
    }

    const double step = s.table * frame_time_;
    const geometry::Vec3 shift(
        direction(input, Action::TableLeft, Action::TableRight) * step + input.table_left,
        -direction(input, Action::TableUp, Action::TableDown) * step,
        direction(input, Action::TableHead, Action::TableFeet) * step + input.table_head);
    if (!shift.isZero()) {
        const geometry::Vec3& reach = script::table_reach;
        const geometry::Vec3 asked = console.table() + shift;
        geometry::Vec3 place = asked.cwiseMax(-reach).cwiseMin(reach);
        for (int k = 0; k < 3; ++k) place[k] = rounded(place[k], 1e-2);
        if (asked != asked.cwiseMax(-reach).cwiseMin(reach)) warn(messages, "The table goes no further");
        if (place != console.table()) commands.push_back(script::MoveTable{place});
    }
}

/// One at a time, of several presses in a frame the first.
void Hands::inject(const Input& input, const exercise::Simulation& simulation,
                   std::vector<script::Command>& commands, Messages& messages) const {
    for (const int index : input.injections) {
        Answer answer = room::inject(keys_.injections.at(static_cast<std::size_t>(index)), simulation);
        messages.push_back(
            {std::move(answer.said), answer.command ? render::Notice::Info : render::Notice::Warning});
        if (!answer.command) continue;
        commands.push_back(*answer.command);
        return;
    }
}

/// The balloon's pressure, the stent's sheath, and which device is used.
void Hands::treat(const Input& input, const exercise::Simulation& simulation,
                  std::vector<script::Command>& commands, Messages& messages) {
    const auto pressed = [&](Action action) {
        return std::ranges::find(input.pressed, action) != input.pressed.end();
    };
    const bool goes_on = deploys_.held, inflate = is_due(input.holds(Action::Inflate), inflates_),
               deploy = is_due(input.holds(Action::Deploy), deploys_);
    const bool deflate = pressed(Action::Deflate), next = pressed(Action::NextBalloon);
    if (!inflate && !deploy && !deflate && !next) return;
    const auto which = simulation.scenario().index_of(script::DeviceRole::Balloon);
    if (!which) return warn(messages, "This exercise has neither balloon nor stent");
    if (simulation.scenario().relaxer.kind != physics::RelaxerKind::Global)
        return warn(messages, "Balloons and stents work with the method \"global\" only");
    const exercise::Inflation& now = *simulation.treatment().inflation();
    const scenario::Device& device = simulation.devices()[static_cast<std::size_t>(*which)].device;
    if (deflate) {
        commands.push_back(script::Deflate{});
    } else if (inflate) {
        const double reached = std::floor(std::max(now.wanted, now.pressure) + 1e-6);
        commands.push_back(script::Inflate{std::min(script::largest_inflation, reached + atm_step)});
    } else if (deploy && device.stent && device.stent->law.self_expanding) {
        commands.push_back(script::RetrieveSheath{sheath_step});
    } else if (deploy && !goes_on) {
        commands.push_back(script::Deploy{});
    }
    if (next) take_next_balloon(simulation, commands, messages);
}

void Hands::take_next_balloon(const exercise::Simulation& simulation, std::vector<script::Command>& commands,
                              Messages& messages) const {
    using script::DeviceRole;
    const auto which = static_cast<std::size_t>(*simulation.scenario().index_of(DeviceRole::Balloon));
    const scenario::PlacedDevice& placed = simulation.devices()[which];
    const exercise::Inflation& now = *simulation.treatment().inflation();
    if (placed.tray.empty()) return warn(messages, "There is no other balloon or stent on the tray");
    const auto found = std::ranges::find(placed.tray, now.device);
    const auto at = static_cast<std::size_t>(found - placed.tray.begin());
    const std::string& next = placed.tray[found == placed.tray.end() ? 0 : (at + 1) % placed.tray.size()];
    if (next == now.device && !now.burst && !now.deployed)
        return warn(messages, "There is no other balloon or stent on the tray");
    const double inside = simulation.inserted(DeviceRole::Balloon);
    if (now.inflated()) return warn(messages, "The balloon is inflated: deflate it before you take it out");
    if (inside > at_valve)
        return warn(messages, fmt::format("{:.0f} mm of the {} are inside: draw it back to the valve, then "
                                          "take the next",
                                          inside, placed.device.title));
    if (inside > 0) commands.push_back(script::Remove{DeviceRole::Balloon});
    commands.push_back(script::Exchange{next, DeviceRole::Balloon});
}

std::vector<script::Command> Hands::commands(const Input& input, const exercise::Simulation& simulation,
                                             const exercise::StepReport& last, Messages& messages) {
    std::vector<script::Command> commands;
    if (std::ranges::find(input.pressed, Action::BackToStart) != input.pressed.end()) {
        rest();
        wants_roadmap_ = acquires_ = false;
        grasp_.reset();
        commands.push_back(script::Reset{});
        return commands;
    }
    if (!grasp_) grasp_.emplace(simulation);
    press_pedals(input, simulation, commands, messages);
    for (const script::Command& pin : grasp_->pins(simulation)) commands.push_back(pin);
    move_stand(input, simulation, commands, messages);
    inject(input, simulation, commands, messages);
    move_grip(input, simulation, commands, messages);
    treat(input, simulation, commands, messages);
    for (const Side side : sides) move_device(side, input, last, commands, messages);
    return commands;
}

}  // namespace room
