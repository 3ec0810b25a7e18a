#include "engine/exercise/monitor.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace exercise {
namespace {

/// Fraction of earlier images in a live image: detectors retain a few per cent, fluoroscopy's recursive noise
/// filter the rest. A roadmap's is stronger: the logarithm behind bone raises noise.
/// Cine has that of the detector alone: moving vessels would smear.
constexpr float usual_lag = 0.3f, roadmap_lag = 0.5f, cine_lag = 0.05f;

float lag_of(script::ImagingMode mode) {
    return mode == script::ImagingMode::Roadmap ? roadmap_lag
           : mode == script::ImagingMode::Cine  ? cine_lag
                                                : usual_lag;
}

/// Up to this fraction of the image is searched for the mask: at 300 mm of field more than a deep breath
/// moves.
constexpr double searched_fraction = 0.125;
constexpr double least_found = 0.05;   // shift that is made [pixels]
constexpr std::size_t remembered = 4;  // pulses; the oldest counts for those before it, too

/// From the last pulse at another place until the image is sharp [s].
constexpr double settling = 0.3;

bool same_place(render::CArm a, const render::CArm& b) {
    a.opening_width = b.opening_width;
    a.opening_height = b.opening_height;
    return a == b;
}

}  // namespace

Monitor::Monitor(render::Fluoroscope fluoroscope) : fluoroscope_(std::move(fluoroscope)) {}

void Monitor::take(Pulse pulse) {
    const render::Technique technique = fluoroscope_.technique(pulse.arm, pulse.exposure);
    dose_.add(pulse.mode, technique);

    const bool moved = !recent_.empty() && !(recent_.back().pulse.arm == pulse.arm);
    if (!recent_.empty() && !same_place(recent_.back().pulse.arm, pulse.arm))
        moved_ = recent_.back().pulse.time.seconds;
    if (moved || pulse.new_mask) subtraction_.reset();
    // What is subtracted must be as sharp as what it is subtracted from.
    const bool subtracts = pulse.mode == script::ImagingMode::Dsa ||
                           (pulse.mode == script::ImagingMode::Roadmap && subtraction_);
    pulse.exposure.stand_moves = !subtracts && moved_ && pulse.time.seconds - *moved_ < settling - 1e-9;
    if (moved || (!recent_.empty() && recent_.back().pulse.mode != pulse.mode)) recent_.clear();
    const double delivered = technique.delivered * pulse.exposure.detector_dose;
    recent_.push_back({std::move(pulse), delivered, {}});
    if (recent_.size() > remembered) recent_.pop_front();
    image_.reset();

    Recent& last = recent_.back();
    if (last.pulse.mode != script::ImagingMode::Dsa) return;
    if (!subtraction_)
        subtraction_.emplace(signal(last), fluoroscope_.opening(last.pulse.arm),
                             fluoroscope_.scatter_in(signal(last), last.pulse.arm, last.pulse.exposure));
    else
        subtraction_->opacify(signal(last));
}

const render::Field& Monitor::signal(Recent& recent) {
    if (!recent.signal) {
        const Pulse& pulse = recent.pulse;
        recent.signal = fluoroscope_.read(pulse.arm, pulse.seen(), pulse.exposure);
        const auto per_dose = static_cast<float>(1.0 / recent.dose);
        for (float& value : recent.signal->values) value *= per_dose;
    }
    return *recent.signal;
}

const render::Field& Monitor::with_lag(float dose) {
    const float lag = lag_of(recent_.back().pulse.mode);
    // Weights (1 − lag)·lag^k of the k-th pulse back; the oldest takes the remainder to 1.
    std::vector<const float*> pulses;
    for (Recent& recent : recent_) pulses.push_back(signal(recent).values.data());
    const render::Field& size = *recent_.front().signal;
    if (mixed_.width != size.width || mixed_.height != size.height)
        mixed_ = render::Field(size.width, size.height);
    constexpr std::size_t together = 1024;  // number of pixels that fits in the cache
    for (std::size_t start = 0; start < mixed_.values.size(); start += together) {
        const std::size_t count = std::min(together, mixed_.values.size() - start);
        float* const mixed = mixed_.values.data() + start;
        std::copy_n(pulses[0] + start, count, mixed);
        for (std::size_t i = 1; i < pulses.size(); ++i) {
            const float* const next = pulses[i] + start;
            for (std::size_t p = 0; p < count; ++p) mixed[p] += (1.0f - lag) * (next[p] - mixed[p]);
        }
        for (std::size_t p = 0; p < count; ++p) mixed[p] *= dose;
    }
    return mixed_;
}

bool Monitor::map_is_missing() const {
    return !recent_.empty() && recent_.back().pulse.mode == script::ImagingMode::Roadmap &&
           !(subtraction_ && subtraction_->has_map());
}

bool Monitor::shows_difference() const {
    if (recent_.empty() || !subtraction_) return false;
    const script::ImagingMode mode = recent_.back().pulse.mode;
    return mode == script::ImagingMode::Dsa ||
           (mode == script::ImagingMode::Roadmap && subtraction_->has_map());
}

render::Subtraction::Shift Monitor::mask_shift() const {
    return shows_difference() ? subtraction_->shift() : render::Subtraction::Shift();
}

MaskShift Monitor::shift(const script::ShiftMask& asked) {
    using Mode = script::ShiftMask::Mode;
    MaskShift made;
    made.automatic = asked.mode == Mode::Auto;
    if (!shows_difference()) {
        made.outcome = MaskShift::Outcome::NoMask;
        return made;
    }
    const Pulse& last = recent_.back().pulse;
    const bool roadmap = last.mode == script::ImagingMode::Roadmap;
    render::Subtraction::Shift to{asked.x, asked.y};
    if (asked.mode == Mode::By) {
        to.x += subtraction_->shift().x;
        to.y += subtraction_->shift().y;
    } else if (asked.mode == Mode::Auto) {
        const render::Registration found = subtraction_->registration_with(
            roadmap ? with_lag(1.0f) : signal(recent_.back()), fluoroscope_.measuring_field(last.arm),
            searched_fraction * last.arm.pixels);
        // Hundredths of a pixel are below what noise leaves; a few of them, below what interpolation blurs.
        to = {std::round(found.x * 100) / 100, std::round(found.y * 100) / 100};
        if (std::hypot(to.x, to.y) < least_found) to = {};
        if (!found.found) made.outcome = MaskShift::Outcome::NoMatch;
    }
    const double most = script::largest_shift_fraction * last.arm.pixels;
    made.x = std::clamp(to.x, -most, most);
    made.y = std::clamp(to.y, -most, most);
    made.limited = made.x != to.x || made.y != to.y;
    if (made.outcome == MaskShift::Outcome::NoMatch) {
        made.x = subtraction_->shift().x;
        made.y = subtraction_->shift().y;
        return made;
    }
    subtraction_->shift_mask({made.x, made.y}, roadmap);
    image_.reset();
    return made;
}

const render::GrayImage* Monitor::image() {
    if (recent_.empty()) return nullptr;
    if (image_) return &*image_;
    const Pulse& last = recent_.back().pulse;
    if (last.mode == script::ImagingMode::Dsa) {
        image_ = subtraction_->subtracted(signal(recent_.back()));
    } else if (last.mode == script::ImagingMode::Roadmap && !map_is_missing()) {
        image_ = subtraction_->roadmap(with_lag(1.0f));
    } else {
        const auto dose = static_cast<float>(recent_.back().dose);
        image_ = fluoroscope_.display(last.arm, last.exposure).show(with_lag(dose));
    }
    return &*image_;
}

void Monitor::store_reference() {
    if (const render::GrayImage* shown = image()) reference_ = *shown;
}

void Monitor::clear() {
    recent_.clear();
    moved_.reset();
    subtraction_.reset();
    image_.reset();
    reference_.reset();
    dose_ = {};
}

}  // namespace exercise
