#include "engine/scenario/breathing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "physics/geometry/maths.h"

namespace scenario {

void Breathing::ask(bool hold) {
    if (hold && state_ == State::Gasping) pending_ = Event::Refused;
    if (hold && state_ == State::Free) state_ = State::Asked;
    if (hold) return;
    if (state_ == State::Held) pending_ = Event::Freed;
    if (state_ == State::Asked) state_ = State::Free;
}

void Breathing::breathe(script::BreathManner how) {
    if (how == script::BreathManner::Free && manner_.empty()) return;
    if (manner_.empty()) manner_.emplace_back();
    if (how == script::BreathManner::Cough)
        manner_[0].coughs_for = 0;
    else
        manner_[0].deep = how == script::BreathManner::Deep;
}

double Breathing::depth(double time, const VesselMotion& motion) const {
    const double quiet = inspiration(clock(time), motion.breathing_rate);
    if (manner_.empty()) return quiet;
    const Manner& manner = manner_[0];
    double sum = quiet * (1 + (deep - 1) * manner.fraction);
    if (manner.coughs_for > 0) {
        const double s = geometry::sin(std::numbers::pi * manner.coughs_for / cough_time);
        sum += cough * s * s;
    }
    return sum;
}

/// A frame later.
void Breathing::change_manner(double since) {
    if (manner_.empty()) return;
    Manner& manner = manner_[0];
    const double part = since / becomes_deep;
    manner.fraction =
        manner.deep ? std::min(1.0, manner.fraction + part) : std::max(0.0, manner.fraction - part);
    if (state_ == State::Free) behind_ -= (deep_speed - 1) * manner.fraction * since;
    if (manner.coughs_for >= 0) manner.coughs_for += since;
    if (manner.coughs_for >= cough_time) manner.coughs_for = -1;
    if (!manner.deep && manner.fraction == 0 && manner.coughs_for < 0) manner_.clear();
}

Breathing::Event Breathing::step(double time, double since, const VesselMotion& motion) {
    constexpr double rounding = 1e-9;
    Event event = std::exchange(pending_, Event::None);
    change_manner(since);
    const auto release = [&](State to) {
        // The last frame was the last of the hold: breathing goes on from there.
        behind_ = time - since - held_at_;
        state_ = to;
        since_ = 0;
    };
    if (state_ == State::Held && event == Event::Freed) release(State::Free);
    switch (state_) {
        case State::Free:
            break;
        case State::Asked:
            if (inspiration(clock(time), motion.breathing_rate) > empty) break;
            held_at_ = clock(time);
            state_ = State::Held;
            since_ = 0;
            event = Event::Held;
            break;
        case State::Held:
            since_ += since;
            if (since_ < motion.breath_hold - rounding) break;
            release(State::Gasping);
            behind_ -= (gasp_speed - 1) * since;
            event = Event::Gasped;
            break;
        case State::Gasping:
            since_ += since;
            behind_ -= (gasp_speed - 1) * since;
            if (since_ >= gasp_time - rounding) state_ = State::Free;
            break;
    }
    return event;
}

namespace {

constexpr double seconds_per_minute = 60.0;

double phase(double time, double rate) {
    const double cycles = time * rate / seconds_per_minute;
    return cycles - std::floor(cycles);
}

}  // namespace

double contraction(double time, double rate) {
    constexpr double systole = 1.0 / 3;
    const double p = phase(time, rate);
    const double part = p < systole ? p / systole : 1 + (p - systole) / (1 - systole);
    return 0.5 * (1 - geometry::cos(std::numbers::pi * part));
}

double peristalsis(double time) {
    constexpr double period = 60.0;  // [s]
    return 0.5 * (1 - geometry::cos(2 * std::numbers::pi * time / period));
}

double inspiration(double time, double rate) {
    const double s = geometry::sin(std::numbers::pi * phase(time, rate));
    return s * s * s * s;
}

}  // namespace scenario
