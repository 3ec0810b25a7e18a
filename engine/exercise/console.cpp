#include "engine/exercise/console.h"

#include <cmath>
#include <utility>

namespace exercise {

Console::Console(const render::CArm& start, double frame_rate, std::optional<double> pulse_rate)
    : frame_rate_(frame_rate), arm_(start), pulse_rate_(pulse_rate.value_or(frame_rate)) {}

void Console::apply(const script::MoveArm& move) {
    arm_ = script::moved(arm_, move);
}

void Console::apply(const script::Collimate& collimate) {
    arm_.opening_width = collimate.width;
    arm_.opening_height = collimate.height;
}

void Console::apply(const script::SetFilter& set) {
    (set.kind == script::FilterKind::Wedge ? arm_.wedge : arm_.lung_shutter) = set.place;
}

void Console::apply(const script::MoveTable& move) {
    table_ = move.place;
}

void Console::apply(const script::Beam& pedal) {
    if (pedal.on && !beam_on_) beam_frames_ = 0;
    beam_on_ = pedal.on;
}

void Console::apply(const script::SetMode& set) {
    mode_ = set.mode;
}

void Console::apply(const script::SetPulseRate& set) {
    pulse_rate_ = set.rate;
}

void Console::apply(const script::NewMask&) {
    mask_asked_ = true;
}

void Console::apply(const script::StoreReference&) {
    reference_asked_ = true;
}

void Console::apply(const script::ShiftMask& shift) {
    shifts_asked_.push_back(shift);
}

ConsoleEvents Console::end_frame() {
    ConsoleEvents events;
    events.reference = std::exchange(reference_asked_, false);
    events.shifts = std::exchange(shifts_asked_, {});
    if (!beam_on_) return events;
    // There is a pulse in the pedal's first frame, then in each frame in which another 1/rate has elapsed.
    const double pulses_per_frame = pulse_rate_ / frame_rate_;
    const int frame = beam_frames_++;
    const auto pulses_by = [&](int frames) { return std::floor(frames * pulses_per_frame + 1e-9); };
    events.pulse = frame == 0 || pulses_by(frame) > pulses_by(frame - 1);
    if (events.pulse && mode_ == script::ImagingMode::Dsa) events.mask = std::exchange(mask_asked_, false);
    return events;
}

render::CArm Console::arm() const {
    render::CArm arm = arm_;
    arm.isocentre -= table_;
    return arm;
}

}  // namespace exercise
