#include "engine/exercise/room_readout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <utility>

#include "engine/exercise/handling.h"
#include "engine/exercise/imaging.h"
#include "engine/exercise/tip_pressure.h"
#include "physics/wire/energy.h"

namespace exercise {
namespace {

constexpr double kink =
    std::numbers::pi / 3;  // bend of one joint beyond which Eq. 1 no longer straightens it [rad]

std::string frames(int count) {
    return fmt::format("{} frame{}", count, count == 1 ? "" : "s");
}

/// What would have put the tip in the middle of the image: the table where it reaches so far.
std::string what_shows(const geometry::Vec3& table, const geometry::Vec3& tip) {
    if ((table.cwiseAbs() - script::table_reach).maxCoeff() <= 0)
        return fmt::format("'table {:.0f} {:.0f} {:.0f} mm'", table.x(), table.y(), table.z());
    return fmt::format("[c_arm] isocentre_mm = [{:.0f}, {:.0f}, {:.0f}]", tip.x(), tip.y(), tip.z());
}

constexpr double history = 10.0;       // of forces [s]
constexpr double curve_history = 4.0;  // of pressure and electrocardiogram [s]
constexpr int pressures_a_frame = 4;
constexpr double message_time = 4.0;  // for which a message stays [s]
constexpr std::size_t most_messages = 6;
constexpr double table_height = 900.0;  // of its top above the floor, at the start [mm]

const char* label_of(script::ImagingMode mode) {
    constexpr std::array<const char*, script::imaging_modes.size()> labels = {"FLUORO", "DSA", "ROADMAP",
                                                                              "CINE"};
    return labels[static_cast<std::size_t>(mode)];
}

/// The balloon or the stent that is used now.
std::optional<render::Readout::Balloon> balloon_of(const Simulation& simulation) {
    const Inflation* const now = simulation.treatment().inflation();
    const auto which = simulation.scenario().index_of(script::DeviceRole::Balloon);
    if (!now || !which) return {};
    const scenario::Device& device = simulation.devices()[static_cast<std::size_t>(*which)].device;
    render::Readout::Balloon seen;
    seen.title = device.title;
    seen.burst = now->burst;
    seen.deployed = now->deployed;
    if (device.balloon) {
        const scenario::Balloon& balloon = *device.balloon;
        seen.pressure = now->pressure;
        seen.nominal = balloon.nominal;
        seen.rated = balloon.rated;
        double least = std::numeric_limits<double>::infinity(), most = 0;
        const physics::Bulge shape{balloon.from_tip - balloon.cone, now->radii};
        for (double s = 0; s <= balloon.length; s += physics::Bulge::spacing) {
            const double r = shape.radius(balloon.from_tip + s);
            least = std::min(least, r), most = std::max(most, r);
        }
        if (most <= 0) least = most = 0.5 * balloon.law.profile;
        seen.diameter = 2 * most;
        seen.waist = 2 * least;
    }
    if (device.stent) {
        seen.stent = device.stent->length;
        // The sheath is measured along the crimped stent.
        if (device.stent->law.self_expanding) seen.out = now->uncovered * (1 - device.stent->foreshortening);
    }
    return seen;
}

}  // namespace

std::string mask_shift_sentence(const MaskShift& shift) {
    if (shift.outcome == MaskShift::Outcome::NoMask)
        return "The mask was not shifted: the image is no subtraction";
    if (shift.outcome == MaskShift::Outcome::NoMatch)
        return "The mask was not shifted: it has nothing in common with the image";
    if (shift.x == 0 && shift.y == 0)
        return shift.automatic ? "The mask fits best without a shift" : "The mask is where it was taken";
    return fmt::format("The mask was shifted by {:.2f} pixels to the {} and {:.2f} {}{}", std::abs(shift.x),
                       shift.x < 0 ? "left" : "right", std::abs(shift.y), shift.y < 0 ? "up" : "down",
                       shift.limited ? ": no further than a quarter of the image" : "");
}

void Notices::watch_tip(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    if (!simulation.console().beam_on()) return;
    const auto shows = [&](const geometry::Vec3& place) { return in_open_field(simulation, place); };
    const bool unseen = !shows(simulation.tip());
    if (unseen && !unseen_.now && unseen_.episodes++ == 0) {
        unseen_.first = frame.time.index;
        unseen_.remedy = what_shows(table_to_show(simulation, simulation.tip()), simulation.tip());
        const geometry::Polyline wire = simulation.path_of(script::DeviceRole::Wire);
        wire_was_out_ = !beam_was_on_ && std::ranges::none_of(wire, shows);
    }
    unseen_.frames += unseen;
    unseen_.now = unseen;
    beam_was_on_ = true;
}

void Notices::observe(const Frame& frame) {
    watch_tip(frame);
    const StepReport& report = frame.motion;
    stopped_withdrawals_ += report.withdrawal_stopped;
    past_ends_ += report.past_vessel_end;
    used_up_ += report.whole_wire_is_in;
    kinked_ += report.relax.largest_bend > kink;
    settling_ += report.settling;
    refused_ += report.refused && !report.buckled;
    buckled_ += report.buckled;
    too_thick_ += report.too_thick;
    if (!report.denied.empty() && std::ranges::find(denied_, report.denied) == denied_.end())
        denied_.push_back(report.denied);
    for (const MaskShift& shift : frame.mask_shifts) {
        if (!shift.automatic && !shift.limited && shift.outcome == MaskShift::Outcome::Shifted) continue;
        mask_shifts_.add(frame.time.index, mask_shift_sentence(shift));
    }
    for (const Injury& injury :
         frame.simulation.injuries().all().last(static_cast<std::size_t>(report.injuries)))
        injuries_.add(frame.time.index, sentence(injury, frame.simulation));
    for (const TreatmentEvent& event : report.treated)
        if (event.kind != TreatmentEvent::Kind::Deployed)
            treated_.add(frame.time.index, sentence(event, frame.simulation.anatomy()));
    for (const std::string& torsion : report.torsions)
        changes_.add(frame.time.index, "from now on " + torsion);
    if (!report.vessels.empty()) changes_.add(frame.time.index, "from now on " + report.vessels);
    gasps_ += report.breath == scenario::Breathing::Event::Gasped;
    late_ += report.waiting_insertion != 0 || report.waiting_rotation != 0;
    most_waiting_ = std::max(most_waiting_, std::abs(report.waiting_insertion));
    const bool moved = !report.settling && report.relax.newton_steps > 0;
    flat_ += moved && report.relax.at_rest() && !report.relax.converged();
    restless_ += moved && !report.relax.at_rest();
    crossed_ += report.deepest_crossing > 0;
    const Console& console = frame.simulation.console();
    limited_doses_ +=
        report.console.pulse && dose_is_limited(frame.simulation.scenario(), console.arm(), console.mode());
    deepest_crossing_ = std::max(deepest_crossing_, report.deepest_crossing);
}

void Notices::First::add(int frame, const std::string& sentence) {
    if (sentences.size() < most)
        sentences.push_back(fmt::format("frame {}: {}", frame, sentence));
    else
        ++more;
}

void Notices::First::end(std::vector<std::string>& text, const char* what) const {
    text.insert(text.end(), sentences.begin(), sentences.end());
    if (more > 0) text.push_back(fmt::format("... and {} more {}", more, what));
}

std::vector<std::string> Notices::text() const {
    std::vector<std::string> result;
    injuries_.end(result, "injuries");
    treated_.end(result, "events of the balloon");
    const auto in_frames = [&](int count, fmt::format_string<std::string> text) {
        if (count > 0) result.push_back(fmt::format(text, frames(count)));
    };
    in_frames(stopped_withdrawals_, "withdrawal stopped at the introducer in {}");
    in_frames(past_ends_, "the tip was past an end of the vessels in {}: there they narrow and end");
    in_frames(used_up_, "insertion stopped in {}: the whole wire was in; a longer one has another length_mm");
    if (unseen_.frames > 0) {
        result.push_back(fmt::format(
            "{} in {}{}: in frame {} {} would have brought the tip to the middle; the C-arm's angle and a "
            "wider field show more too",
            wire_was_out_ ? "the beam came on with nothing of the wire in the image, and its tip was outside"
                          : "the tip was outside the image",
            frames(unseen_.frames), unseen_.episodes > 1 ? fmt::format(", {} times", unseen_.episodes) : "",
            unseen_.first, unseen_.remedy));
    }
    in_frames(kinked_,
              "the wire was bent by more than 60 degrees at one joint in {}: shorter segments or a stiffer "
              "wire would follow");
    in_frames(settling_,
              "the wire was on its way at the end of {}, as in a snap: they show it where it was last at "
              "rest; more [relaxer] updates_per_frame would let it arrive");
    if (late_ > 0) {
        result.push_back(
            fmt::format("the wire lagged behind the hand at the end of {}, by up to {:.2g} mm: the motion "
                        "waited for the wire to come to rest",
                        frames(late_), most_waiting_));
    }
    in_frames(
        buckled_,
        "a push was not passed on in {}: it asked for more than the shaft outside bears before it bows");
    in_frames(refused_, "a motion was not made in {}: it led to no rest that the wire could be in");
    in_frames(too_thick_, "a catheter stopped in {}: the vessel before its tip is narrower than it is");
    if (limited_doses_ > 0) {
        result.push_back(
            fmt::format("the detector's dose was limited to {:g} nGy in {}: magnification asked for more "
                        "than any detector takes; a lower [imaging] dose would follow the field",
                        render::largest_detector_dose, frames(limited_doses_)));
    }
    for (const std::string& text : denied_) result.push_back(text);
    mask_shifts_.end(result, "shifts");
    changes_.end(result, "changes of shafts and vessels");
    if (gasps_ > 0)
        result.push_back(
            fmt::format("the patient had to breathe {} before the breath was freed; [motion] breath_hold_s "
                        "is how long he can hold it",
                        gasps_ == 1 ? "once" : fmt::format("{} times", gasps_)));
    in_frames(flat_, "the wire rested at a flat minimum or a saddle in {}: another rest may be as near");
    in_frames(restless_,
              "the wire had not come to rest at the end of {}: a mesh's planes jump between its triangles, "
              "which a distance field does not");
    if (crossed_ > 0) {
        result.push_back(
            fmt::format("between two joints the wire crossed the wall, by up to {:.2g} mm, at the end of {}; "
                        "shorter segments follow the wall closer",
                        deepest_crossing_, frames(crossed_)));
    }
    return result;
}

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

void RoomReadout::follow_balloon(const Frame& seen) {
    const Simulation& simulation = seen.simulation;
    using Kind = TreatmentEvent::Kind;
    for (const TreatmentEvent& event : seen.motion.treated)
        say(sentence(event, simulation.anatomy()), event.kind == Kind::Deployed ? render::Notice::Info
                                                   : event.kind == Kind::Burst  ? render::Notice::Warning
                                                                                : render::Notice::Alarm);
    const Inflation* const now = simulation.treatment().inflation();
    const auto which = simulation.scenario().index_of(script::DeviceRole::Balloon);
    if (!now || !which) return;
    const scenario::Device& device = simulation.devices()[static_cast<std::size_t>(*which)].device;
    const bool inflated = now->pressure > 0 && now->wanted > 0;
    if (inflated && !was_inflated_) inflated_ = 0;
    was_inflated_ = inflated;
    if (now->pressure > 0) inflated_ += 1 / simulation.scenario().frame_rate;
    const bool beyond = device.balloon && now->pressure > device.balloon->rated;
    if (beyond && !beyond_rated_)
        say(fmt::format("The balloon is beyond its rated pressure of {:g} atm and may burst",
                        device.balloon->rated),
            render::Notice::Warning);
    beyond_rated_ = beyond;
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

    const auto role = pressure_device(simulation);
    const auto beat = role ? beat_at_tip(simulation, *role) : std::nullopt;
    for (int k = 1; k <= pressures_a_frame; ++k)
        pressures_.push_back(
            beat ? beat->pressure(heart_phase_at(
                       simulation, simulation.time() + (k - pressures_a_frame) / (pressures_a_frame * rate)))
                 : std::numeric_limits<double>::quiet_NaN());
    while (pressures_.size() > curve_history * rate * pressures_a_frame) pressures_.pop_front();

    const bool hard = hard_press(seen).has_value();
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
    if (!report.exchanged.empty()) {
        const auto devices = simulation.devices();
        const auto other = std::ranges::find_if(devices, [&](const scenario::PlacedDevice& placed) {
            return placed.role == script::DeviceRole::Balloon && placed.device.title == report.exchanged;
        });
        say((other == devices.end() ? "The wire is now: " : "On the wire is now: ") + report.exchanged,
            render::Notice::Success);
    }
    follow_balloon(seen);
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
    r.mode = label_of(console.mode());
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
        r.image = render::ImageMarks{label_of(pulse.mode), pulse.arm.lao,     pulse.arm.cranial,
                                     pulse_rate_,          pulse.arm.sid,     pulse.arm.detector_width,
                                     pulse.time.index,     pulse.time.seconds};
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
    r.balloon = balloon_of(simulation);
    if (r.balloon) r.balloon->seconds = inflated_;
    r.tip_to_target = simulation.tip_to_target();
    if (!simulation.contacts().empty()) r.tip_force = simulation.contacts().back().force();
    if (!wall_forces_.empty()) r.largest_wall_force = wall_forces_.back();
    r.force_history.assign(wall_forces_.begin(), wall_forces_.end());
    r.history_length = history;
    r.heart_rate = scenario.blood.heart_rate;
    r.pressure_history.assign(pressures_.begin(), pressures_.end());
    constexpr int samples = 400;
    for (int k = 1; k <= samples; ++k)
        r.ecg_history.push_back(
            ecg_at(simulation, simulation.time() + curve_history * (k - samples) / samples));
    if (const auto role = pressure_device(simulation)) {
        r.pressure_of = script::name_of(*role);
        if (const auto at = pressure_at_tip(simulation, *role)) {
            r.pressure = at->now;
            r.systolic = at->systolic;
            r.diastolic = at->diastolic;
            r.mean_pressure = at->mean;
        }
    }
    r.contrast = simulation.contrast().injected();
    r.contrast_limit = scenario.blood.limit;
    r.injection_rate = simulation.contrast().injection_rate();
    return r;
}

}  // namespace exercise
