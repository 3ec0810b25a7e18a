#include "render/xray/subtraction.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "render/picture/fast_math.h"
#include "render/picture/filter.h"
#include "render/picture/resample.h"
#include "render/xray/display.h"

namespace render {
namespace {

/// Keeps empty pixels out of the logarithm; a pulse has about 1 per unit of dose.
constexpr float least_signal = 1e-3f;
/// At least this fraction of the signal is kept as primary, where the estimate of scatter is too high.
constexpr float least_primary = 0.12f;

/// Greys around a background, linear for the first fraction of the way to black and to white.
struct Shoulder {
    float background, linear;
    float operator()(float grey) const {
        const float below = background - grey, room = below > 0.0f ? background : 255.0f - background;
        const float gone = std::abs(below) / room;  // 1 at black or white
        const float soft = 1.0f - (1.0f - linear) * fast_exp((linear - gone) / (1.0f - linear));
        const float shown = room * (gone > linear ? soft : gone);
        return background - (below > 0.0f ? shown : -shown);
    }
};

}  // namespace

Subtraction::Subtraction(Field mask, Field open, const SubtractionSpec& spec)
    : Subtraction(mask, std::move(open), Field(mask.width, mask.height), spec) {}

Subtraction::Subtraction(Field mask, Field open, Field scatter, const SubtractionSpec& spec)
    : spec_(spec), scatter_(std::move(scatter)), open_(std::move(open)) {
    assert(mask.values.size() == open_.values.size() && mask.values.size() == scatter_.values.size());
    for (float& value : mask.values) value = std::max(0.0f, value);  // also replaces NaN
    for (float& value : scatter_.values) value *= static_cast<float>(spec_.scatter);
    log_mask_ = std::move(mask);
    std::vector<float>& values = log_mask_.values;
    for (std::size_t start = 0; start < values.size(); start += FastLog::together) {
        const auto some =
            std::span(values).subspan(start, std::min(FastLog::together, values.size() - start));
        log_of(some, start, some);
    }
}

/// Logarithm of the signal without scatter. The mask's scatter is used for every pulse: a vessel full of
/// contrast changes scatter little, as the whole body scatters.
void Subtraction::log_of(std::span<const float> signal, std::size_t start, std::span<float> log) const {
    const float* const scatter = scatter_.values.data() + start;
    for (std::size_t i = 0; i < signal.size(); ++i) {
        const float value = std::max(least_signal, signal[i]);  // also replaces NaN
        log[i] = std::max(value - scatter[i], least_primary * value);
    }
    fast_log()(log);
}

template <class Use>
void Subtraction::for_differences(const Field& signal, const Use& use) const {
    assert(signal.values.size() == log_mask_.values.size());
    const Field& log_of_mask = log_mask();
    std::array<float, FastLog::together> log;
    for (std::size_t start = 0; start < signal.values.size(); start += log.size()) {
        const std::size_t count = std::min(log.size(), signal.values.size() - start);
        log_of(std::span(signal.values).subspan(start, count), start, std::span(log).first(count));
        const float* const mask = log_of_mask.values.data() + start;
        for (std::size_t i = 0; i < count; ++i) log[i] = mask[i] - log[i];
        use(start, std::span<float>(log).first(count));
    }
}

Field Subtraction::difference(const Field& signal) const {
    Field result(signal.width, signal.height);
    for_differences(signal, [&](std::size_t start, std::span<const float> difference) {
        std::copy(difference.begin(), difference.end(),
                  result.values.begin() + static_cast<std::ptrdiff_t>(start));
    });
    return result;
}

template <class Grey>
GrayImage Subtraction::framed(const Field& signal, double background, const Grey& grey) const {
    const Shoulder shoulder{static_cast<float>(background), static_cast<float>(spec_.linear)};
    GrayImage image{signal.width, signal.height, std::vector<std::uint8_t>(signal.values.size())};
    const Field& seen = this->open();
    for_differences(signal, [&](std::size_t start, std::span<float> difference) {
        const float* const open = seen.values.data() + start;
        std::uint8_t* const shown = image.pixels.data() + start;
        float* const level = difference.data();
        const std::size_t count = difference.size();
        for (std::size_t i = 0; i < count; ++i) level[i] = shoulder(grey(start + i, level[i]));
        for (std::size_t i = 0; i < count; ++i) {
            const float up = shutter_grey + open[i] * (level[i] - shutter_grey) + 0.5f;
            shown[i] = static_cast<std::uint8_t>(up);
        }
    });
    return image;
}

void Subtraction::shift_mask(const Shift& shift, bool with_map) {
    if (with_map && has_map()) {
        map_shift_.x += shift.x - shift_.x;
        map_shift_.y += shift.y - shift_.y;
    }
    shift_ = shift;
    make_shifted();
}

/// Makes again what follows from the shifts.
void Subtraction::make_shifted() {
    vessels_ = shifted_mask_ = shifted_open_ = {};
    if (!shift_.any()) return;
    shifted_mask_ = shifted(log_mask_, shift_.x, shift_.y);
    const int width = open_.width, height = open_.height;
    shifted_open_ = shifted(open_, shift_.x, shift_.y);
    for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
            const std::size_t pixel = static_cast<std::size_t>(j) * width + i;
            const bool known = i - shift_.x >= 0.0 && i - shift_.x <= width - 1.0 && j - shift_.y >= 0.0 &&
                               j - shift_.y <= height - 1.0;
            float& seen = shifted_open_.values[pixel];
            seen = known ? std::clamp(seen, 0.0f, open_.values[pixel]) : 0.0f;
        }
    }
}

Registration Subtraction::registration_with(const Field& signal, const Field& where, double reach) const {
    Field log(signal.width, signal.height);
    for (std::size_t start = 0; start < log.values.size(); start += FastLog::together) {
        const std::size_t count = std::min(FastLog::together, log.values.size() - start);
        log_of(std::span(signal.values).subspan(start, count), start,
               std::span(log.values).subspan(start, count));
    }
    return registration(log_mask_, log, where, reach);
}

GrayImage Subtraction::subtracted(const Field& signal) const {
    const auto gain = static_cast<float>(spec_.dsa_gain);
    const auto background = static_cast<float>(spec_.dsa_background);
    return framed(signal, spec_.dsa_background,
                  [=](std::size_t, float difference) { return background - gain * difference; });
}

void Subtraction::opacify(const Field& signal) {
    Field opacity = difference(signal);
    blur(opacity, spec_.map_blur);
    if (map_shift_.any()) {
        // The map goes on where it was shown.
        mean_ = shifted(mean_, map_shift_.x, map_shift_.y);
        map_ = shifted(map_, map_shift_.x, map_shift_.y);
        map_shift_ = {};
    }
    if (!has_map()) {
        mean_ = map_ = std::move(opacity);
    } else {
        const auto fraction = static_cast<float>(spec_.map_fraction);
        for (std::size_t i = 0; i < map_.values.size(); ++i) {
            mean_.values[i] += fraction * (opacity.values[i] - mean_.values[i]);
            map_.values[i] = std::max(map_.values[i], mean_.values[i]);
        }
    }
    vessels_ = {};
}

const Field& Subtraction::vessels() {
    if (!vessels_.values.empty()) return vessels_;
    const auto brightness = static_cast<float>(spec_.map_brightness);
    const auto density = static_cast<float>(spec_.map_density);
    vessels_ = shifted(map_, map_shift_.x, map_shift_.y);
    for (float& value : vessels_.values)
        value = brightness * (1.0f - std::exp(-density * std::max(value, 0.0f)));
    return vessels_;
}

GrayImage Subtraction::roadmap(const Field& signal) {
    if (!has_map()) throw std::logic_error("a roadmap needs a map: no pulse was taken since the mask");
    const auto gain = static_cast<float>(spec_.roadmap_gain);
    const auto background = static_cast<float>(spec_.roadmap_background);
    const float* const bright = vessels().values.data();
    return framed(signal, spec_.roadmap_background, [=](std::size_t i, float difference) {
        return background + bright[i] - gain * difference;
    });
}

}  // namespace render
