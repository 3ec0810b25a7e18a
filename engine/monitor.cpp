#include "engine/monitor.h"

#include <utility>

namespace engine {
namespace {

/// Share of a live image that is the sum of those before: detectors keep a few per cent, and fluoroscopy's
/// recursive noise filter the rest.
constexpr float lag = 0.3f;
constexpr std::size_t remembered = 4;  // pulses; what was before counts less than 1 %

}  // namespace

Monitor::Monitor(render::Fluoroscope fluoroscope) : fluoroscope_(std::move(fluoroscope)) {}

void Monitor::take(Pulse pulse) {
    const render::Technique technique = fluoroscope_.technique(pulse.arm, pulse.exposure);
    ++dose_.pulses;
    dose_.air_kerma += technique.air_kerma;
    dose_.area_product += technique.area_product;
    dose_.last = technique;

    const bool moved = !recent_.empty() && !(recent_.back().pulse.arm == pulse.arm);
    if (moved || pulse.new_mask) subtraction_.reset();
    if (moved || (!recent_.empty() && recent_.back().pulse.mode != pulse.mode)) recent_.clear();
    const double delivered = technique.delivered * pulse.exposure.detector_dose;
    recent_.push_back({std::move(pulse), delivered, {}});
    if (recent_.size() > remembered) recent_.pop_front();
    image_.reset();

    Recent& last = recent_.back();
    if (last.pulse.mode != ImagingMode::dsa) return;
    if (!subtraction_)
        subtraction_.emplace(signal(last), fluoroscope_.opening(last.pulse.arm));
    else
        subtraction_->opacify(signal(last));
}

const render::Field& Monitor::signal(Recent& recent) {
    if (!recent.signal) {
        const Pulse& pulse = recent.pulse;
        recent.signal = fluoroscope_.read(pulse.arm, pulse.joints, pulse.exposure);
        const auto per_dose = static_cast<float>(1.0 / recent.dose);
        for (float& value : recent.signal->values) value *= per_dose;
    }
    return *recent.signal;
}

render::Field Monitor::with_lag() {
    // Weights (1 − lag)·lag^k of the k-th pulse back; the oldest takes what is left of 1.
    render::Field mixed = signal(recent_.front());
    for (std::size_t i = 1; i < recent_.size(); ++i) {
        const std::vector<float>& next = signal(recent_[i]).values;
        for (std::size_t p = 0; p < next.size(); ++p)
            mixed.values[p] += (1.0f - lag) * (next[p] - mixed.values[p]);
    }
    return mixed;
}

bool Monitor::map_is_missing() const {
    return !recent_.empty() && recent_.back().pulse.mode == ImagingMode::roadmap &&
           !(subtraction_ && subtraction_->has_map());
}

const render::GrayImage* Monitor::image() {
    if (recent_.empty()) return nullptr;
    if (image_) return &*image_;
    const Pulse& last = recent_.back().pulse;
    if (last.mode == ImagingMode::dsa) {
        image_ = subtraction_->subtracted(signal(recent_.back()));
    } else if (last.mode == ImagingMode::roadmap && !map_is_missing()) {
        image_ = subtraction_->roadmap(with_lag());
    } else {
        render::Field shown = with_lag();
        const auto dose = static_cast<float>(recent_.back().dose);
        for (float& value : shown.values) value *= dose;
        image_ = fluoroscope_.display(last.arm, last.exposure).show(shown);
    }
    return &*image_;
}

void Monitor::store_reference() {
    if (const render::GrayImage* shown = image()) reference_ = *shown;
}

void Monitor::clear() {
    recent_.clear();
    subtraction_.reset();
    image_.reset();
    reference_.reset();
    dose_ = {};
}

}  // namespace engine
