#include "engine/exercise/room_readout.h"

#include <utility>

#include "engine/exercise/notices.h"
#include "engine/exercise/open_field.h"
#include "physics/wire/energy.h"

namespace exercise {
namespace {

constexpr double history = 10.0;      // of forces [s]
constexpr double message_time = 4.0;  // for which a message stays [s]
constexpr std::size_t most_messages = 6;
constexpr double table_height = 900.0;  // of its top above the floor, at the start [mm]

const char* name_of(script::ImagingMode mode) {
    constexpr const char* names[] = {"FLUORO", "DSA", "ROADMAP"};
    return names[static_cast<int>(mode)];
}

}  // namespace

void RoomReadout::say(std::string text, render::Notice notice) {
    std::erase_if(messages_, [&](const TimedMessage& m) { return m.message.text == text; });
    messages_.push_back({frame_, {std::move(text), notice}});
    if (messages_.size() > most_messages) messages_.pop_front();
}

std::vector<render::Message> RoomReadout::messages() const {
    std::vector<render::Message> shown;
    for (const TimedMessage& m : messages_) shown.push_back(m.message);
    return shown;
}

/// Notifies once of each kind of dose, at its threshold.
void RoomReadout::notify_of_dose(const Score& score) {
    using At = render::DoseNotification;
    const std::pair<bool, const char*> kinds[] = {
        {score.air_kerma && *score.air_kerma >= At::air_kerma, "Dose: 3 Gy of air kerma are reached"},
        {score.area_product && *score.area_product >= At::kerma_area, "Dose: 300 Gy·cm² are reached"},
        {score.beam_on_time >= At::fluoro_time, "Dose: 30 min of beam are reached"}};
    for (int k = 0; k < 3; ++k) {
        if (!kinds[k].first || (notified_ & 1 << k)) continue;
        notified_ |= 1 << k;
        say(kinds[k].second, render::Notice::Alarm);
    }
}

void RoomReadout::say_of_breath(scenario::Breathing::Event event) {
    using Event = scenario::Breathing::Event;
    if (event == Event::Held) say("The breath is held", render::Notice::Info);
    if (event == Event::Freed) say("The patient breathes", render::Notice::Info);
    if (event == Event::Gasped)
        say("The patient gasps: the breath was held too long", render::Notice::Warning);
    if (event == Event::Refused) say("The patient is still out of breath", render::Notice::Warning);
}

void RoomReadout::observe(const Frame& seen, const Score& score) {
    const Simulation& simulation = seen.simulation;
    const StepReport& report = seen.motion;
    if (report.reset) *this = RoomReadout();
    const double rate = simulation.scenario().frame_rate;
    frame_ = seen.time.attempt;
    while (!messages_.empty() && frame_ - messages_.front().frame > message_time * rate)
        messages_.pop_front();

    wall_forces_.push_back(physics::largest_force(simulation.contacts()));
    while (wall_forces_.size() > history * rate) wall_forces_.pop_front();

    const bool hard = wall_forces_.back() >= render::Readout().force_limit;
    if (hard && !pressed_hard_) say("The wire presses the wall hard", render::Notice::Alarm);
    pressed_hard_ = hard;
    if (report.injuries > 0)
        say(sentence(simulation.injuries().all().back(), simulation), render::Notice::Alarm);
    if (simulation.console().beam_on()) {
        const bool shows = in_open_field(simulation, simulation.tip());
        if (!shows && tip_shows_)
            say("The tip is outside the image: move table or C-arm", render::Notice::Warning);
        tip_shows_ = shows;
    }
    notify_of_dose(score);
    for (; errors_ < score.handling_errors.size(); ++errors_)
        say(fmt::format("Error: {}",
                        handling_error_texts[static_cast<std::size_t>(score.handling_errors[errors_].kind)]),
            render::Notice::Warning);
    if (report.past_vessel_end && !was_past_end_)
        say("The tip is in a branch beyond the vessels shown", render::Notice::Warning);
    was_past_end_ = report.past_vessel_end;
    if (report.whole_wire_is_in) say("The wire is in to its end", render::Notice::Warning);
    if (report.buckled) say("The shaft bows outside: it is pushed too hard", render::Notice::Warning);
    if (report.too_thick) say("A catheter goes no further: the vessel is narrower", render::Notice::Warning);
    if (!report.denied.empty()) say(report.denied, render::Notice::Warning);
    if (!report.exchanged.empty()) say("The wire is now: " + report.exchanged, render::Notice::Success);
    if (report.withdrawal_stopped) say("The tip is at the introducer", render::Notice::Warning);
    constexpr const char* no_map = "No roadmap: take a DSA run first";
    if (seen.monitor && seen.monitor->map_is_missing())
        say(no_map, render::Notice::Warning);
    else
        std::erase_if(messages_, [&](const TimedMessage& m) { return m.message.text == no_map; });
    for (const MaskShift& shift : seen.mask_shifts)
        say(mask_shift_sentence(shift), shift.outcome == MaskShift::Outcome::Shifted && !shift.limited
                                            ? render::Notice::Info
                                            : render::Notice::Warning);
    say_of_breath(report.breath);
    if (report.console.pulse) pulse_rate_ = simulation.console().pulse_rate();
    const bool complete = score.completed;
    if (complete && !was_complete_) say("Target reached", render::Notice::Success);
    was_complete_ = complete;
}

render::Readout RoomReadout::read(const Frame& frame, const Score& score) const {
    const Simulation& simulation = frame.simulation;
    const scenario::Scenario& scenario = simulation.scenario();
    const Console& console = simulation.console();
    const render::CArm arm = console.arm();
    render::Readout r;
    r.title = scenario.title;
    r.mode = name_of(console.mode());
    r.beam_on = console.beam_on();
    r.frame = frame.time.index;
    r.time = frame.time.seconds;
    r.messages = messages();
    r.lao = arm.lao;
    r.cranial = arm.cranial;
    r.sid = arm.sid;
    r.sod = arm.sod;
    r.field_of_view = arm.detector_width;
    r.table =
        render::TablePlace{console.table().z(), console.table().x(), table_height - console.table().y()};
    r.pulse_rate = console.pulse_rate();
    r.fluoro_time = score.beam_on_time;
    if (const Monitor* monitor = frame.monitor; monitor && monitor->last_pulse()) {
        const Pulse& pulse = *monitor->last_pulse();
        r.image = render::ImageMarks{name_of(pulse.mode), pulse.arm.lao,     pulse.arm.cranial,
                                     pulse_rate_,         pulse.arm.sid,     pulse.arm.detector_width,
                                     pulse.time.index,    pulse.time.seconds};
        const render::Subtraction::Shift shift = monitor->mask_shift();
        r.image->mask_x = shift.x;
        r.image->mask_y = shift.y;
        r.detector_dose = monitor->last_pulse()->exposure.detector_dose;
        if (monitor->reference()) r.reference_label = "Reference";
    }
    if (frame.dose && frame.dose->pulses > 0) {
        const Dose& dose = *frame.dose;
        r.tube_voltage = dose.last.kvp;
        r.tube_current = dose.last.current;
        r.pulse_width = dose.last.pulse_width;
        r.air_kerma = dose.air_kerma;
        r.kerma_area = dose.area_product;
        r.air_kerma_rate = console.beam_on() ? dose.last.air_kerma * console.pulse_rate() * 60 : 0.0;
    }
    if (simulation.breathing().state() == scenario::Breathing::State::Held)
        r.breath_held = simulation.breathing().held_for();
    for (const scenario::PlacedDevice& placed : simulation.devices()) {
        const Hand hand = simulation.hand(placed.role);
        r.devices.push_back({std::string(placed.name()), simulation.inserted(placed.role),
                             placed.device.length, hand.turned, hand.load.torque, hand.load.push,
                             simulation.gripped_at(placed.role), hand.bow});
    }
    r.tip_to_target = simulation.tip_to_target();
    if (!simulation.contacts().empty()) r.tip_force = simulation.contacts().back().force();
    if (!wall_forces_.empty()) r.largest_wall_force = wall_forces_.back();
    r.force_history.assign(wall_forces_.begin(), wall_forces_.end());
    r.history_length = history;
    r.contrast = simulation.contrast().injected();
    r.contrast_limit = scenario.blood.limit;
    r.injection_rate = simulation.contrast().injection_rate();
    return r;
}

}  // namespace exercise
