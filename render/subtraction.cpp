#include "render/subtraction.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "render/display.h"
#include "render/fast_log.h"
#include "render/filter.h"

namespace render {

namespace {

/// Keeps empty pixels out of the logarithm; a pulse has about 1 per unit of dose.
constexpr float least_signal = 1e-3f;
/// Of the signal, at least so much is left as primary: behind the densest bone the estimate is too high.
constexpr float least_primary = 0.12f;
/// And of the mean close about a pixel, at most so much is scatter, as at the rim of a body in the open beam.
constexpr float most_scatter = 0.6f;

}  // namespace

Subtraction::Subtraction(Field mask, Field open, const SubtractionSpec& spec)
    : spec_(spec), open_(std::move(open)) {
    assert(mask.values.size() == open_.values.size());
    for (float& value : mask.values) value = std::max(0.0f, value);  // also takes NaN
    const int block = std::max(1, mask.width / 64);
    Field scatter = shrink(mask, block);
    const Field close = gaussian_blur(scatter, 1.0);
    blur(scatter, spec_.scatter_reach * mask.width / block);
    for (std::size_t i = 0; i < scatter.values.size(); ++i) {
        scatter.values[i] =
            std::min(static_cast<float>(spec_.scatter) * scatter.values[i], most_scatter * close.values[i]);
    }
    scatter_ = enlarge(scatter, block, mask.width, mask.height);
    log_mask_ = log_of(std::move(mask));
}

/// Of what is left without scatter. That of the mask serves every pulse: a vessel full of contrast scatters
/// hardly less, for it is the whole body that scatters.
Field Subtraction::log_of(Field signal) const {
    const FastLog& log = fast_log();
    for (std::size_t i = 0; i < signal.values.size(); ++i) {
        const float value = std::max(least_signal, signal.values[i]);  // also takes NaN
        signal.values[i] = log(std::max(value - scatter_.values[i], least_primary * value));
    }
    return signal;
}

/// ln(mask) − ln(signal): positive where less arrives than did.
Field Subtraction::difference(const Field& signal) const {
    assert(signal.values.size() == log_mask_.values.size());
    Field result = log_of(signal);
    for (std::size_t i = 0; i < result.values.size(); ++i)
        result.values[i] = log_mask_.values[i] - result.values[i];
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
    } else {
        for (std::size_t i = 0; i < map_.values.size(); ++i)
            map_.values[i] = std::max(map_.values[i], opacity.values[i]);
    }
    const auto brightness = static_cast<float>(spec_.map_brightness);
    const auto density = static_cast<float>(spec_.map_density);
    vessels_ = map_;
    for (float& value : vessels_.values)
        value = brightness * (1.0f - std::exp(-density * std::max(value, 0.0f)));
}

GrayImage Subtraction::roadmap(const Field& signal) const {
    if (!has_map()) throw std::logic_error("a roadmap needs a map: no pulse was taken since the mask");
    Field grey = difference(signal);
    const auto gain = static_cast<float>(spec_.roadmap_gain);
    const auto background = static_cast<float>(spec_.roadmap_background);
    for (std::size_t i = 0; i < grey.values.size(); ++i)
        grey.values[i] = background + vessels_.values[i] - gain * grey.values[i];
    return framed(grey);
}

}  // namespace render
