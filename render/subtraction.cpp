#include "render/subtraction.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "render/display.h"
#include "render/fast_log.h"
#include "render/filter.h"

namespace render {

namespace {

/// Keeps what is behind closed shutters, and empty pixels, out of the logarithm.
constexpr float least_signal = 1e-3f;

float log_of(float signal) {
    return fast_log()(std::max(signal, least_signal));
}

}  // namespace

Subtraction::Subtraction(Field mask, Field open, const SubtractionSpec& spec)
    : spec_(spec), log_mask_(std::move(mask)), open_(std::move(open)) {
    assert(log_mask_.values.size() == open_.values.size());
    for (float& value : log_mask_.values) value = log_of(value);
}

/// ln(mask) − ln(signal): positive where less arrives than did.
Field Subtraction::difference(const Field& signal) const {
    assert(signal.values.size() == log_mask_.values.size());
    Field result(signal.width, signal.height);
    for (std::size_t i = 0; i < result.values.size(); ++i)
        result.values[i] = log_mask_.values[i] - log_of(signal.values[i]);
    return result;
}

GrayImage Subtraction::framed(const Field& grey) const {
    GrayImage image{grey.width, grey.height, std::vector<std::uint8_t>(grey.values.size())};
    for (std::size_t i = 0; i < grey.values.size(); ++i) {
        const float level = std::clamp(grey.values[i], 0.0f, 255.0f);
        image.pixels[i] =
            static_cast<std::uint8_t>(shutter_grey + open_.values[i] * (level - shutter_grey) + 0.5f);
    }
    return image;
}

GrayImage Subtraction::subtracted(const Field& signal) const {
    Field grey = difference(signal);
    const auto gain = static_cast<float>(spec_.dsa_gain);
    const auto background = static_cast<float>(spec_.dsa_background);
    for (float& value : grey.values) value = background - gain * value;
    return framed(grey);
}

void Subtraction::opacify(const Field& signal) {
    Field opacity = difference(signal);
    blur(opacity, spec_.map_blur);
    if (!has_map()) {
        map_ = std::move(opacity);
        return;
    }
    for (std::size_t i = 0; i < map_.values.size(); ++i)
        map_.values[i] = std::max(map_.values[i], opacity.values[i]);
}

GrayImage Subtraction::roadmap(const Field& signal) const {
    if (!has_map()) throw std::logic_error("a roadmap needs a map: no pulse was taken since the mask");
    Field grey = difference(signal);
    const auto gain = static_cast<float>(spec_.roadmap_gain);
    const auto background = static_cast<float>(spec_.roadmap_background);
    const auto brightness = static_cast<float>(spec_.map_brightness);
    const auto density = static_cast<float>(spec_.map_density);
    for (std::size_t i = 0; i < grey.values.size(); ++i) {
        const float vessel = brightness * (1.0f - std::exp(-density * std::max(map_.values[i], 0.0f)));
        grey.values[i] = background + vessel - gain * grey.values[i];
    }
    return framed(grey);
}

}  // namespace render
