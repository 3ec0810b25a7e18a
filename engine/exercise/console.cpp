#include "engine/exercise/console.h"

#include <cmath>

namespace exercise {

Console::Console(const render::CArm& start, double frame_rate, std::optional<double> pulse_rate)
    : frame_rate_(frame_rate), arm_(start), pulse_rate_(pulse_rate.value_or(frame_rate)) {}

void Console::apply(const script::Command& command) {
    if (const auto* move = std::get_if<script::MoveArm>(&command)) arm_ = script::moved(arm_, *move);
    if (const auto* collimate = std::get_if<script::Collimate>(&command)) {
        arm_.opening_width = collimate->width;
        arm_.opening_height = collimate->height;
    }
    if (const auto* move = std::get_if<script::MoveTable>(&command)) table_ = move->place;
    if (const auto* pedal = std::get_if<script::Beam>(&command)) {
        if (pedal->on && !beam_on_) beam_frames_ = 0;
        beam_on_ = pedal->on;
    }
    if (const auto* set = std::get_if<script::SetMode>(&command)) mode_ = set->mode;
    if (const auto* set = std::get_if<script::SetPulseRate>(&command)) pulse_rate_ = set->rate;
    masks_ += std::holds_alternative<script::NewMask>(command);
    references_ += std::holds_alternative<script::StoreReference>(command);
}

bool Console::end_frame() {
    if (!beam_on_) return false;
    // The pedal's first frame has a pulse, then each one in which another 1/rate is over.
    const double pulses_per_frame = pulse_rate_ / frame_rate_;
    const int frame = beam_frames_++;
    const auto pulses_by = [&](int frames) { return std::floor(frames * pulses_per_frame + 1e-9); };
    return frame == 0 || pulses_by(frame) > pulses_by(frame - 1);
}

render::CArm Console::arm() const {
    render::CArm arm = arm_;
    arm.isocentre -= table_;
    return arm;
}

}  // namespace exercise
