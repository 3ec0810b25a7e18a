#include "render/xray/display.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

#include "render/picture/fast_math.h"
#include "render/picture/filter.h"

namespace render {
namespace {

constexpr float lowest = -4.0f, highest = 3.0f;  // ln of signal over reference, the range of the grey table

/// Range between the darkest and the brightest twentieth of the area that the collimator leaves.
double range_of(const Field& log, const Field& open) {
    std::vector<float> seen;
    for (std::size_t i = 0; i < log.values.size(); i += 7)
        if (open.values[i] > 0.5f) seen.push_back(log.values[i]);
    if (seen.size() < 20) return 0.0;
    const auto at = [&](double fraction) {
        const auto place =
            seen.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(seen.size()));
        std::nth_element(seen.begin(), place, seen.end());
        return *place;
    };
    return at(0.95) - at(0.05);
}

/// What a signal needs added so that its noise, of quanta and electronics, is at most a quarter of the sum.
float lift_of(float quanta) {
    constexpr float most_noise = 0.25f, electronics = 9.0f;  // the latter as variance
    return std::max(0.0f, std::sqrt(std::max(quanta, 0.0f) + electronics) / most_noise - quanta);
}

}  // namespace

Field shutters(const DisplaySpec& spec, const CArm& arm) {
    const int width = arm.pixels, height = arm.pixels;
    Field open(width, height);
    const double unit = arm.pixels;
    const auto half_of = [&](double opening) {
        return std::min(0.5 * unit - spec.shutter_margin * unit, 0.5 * opening / pixel_width(arm));
    };
    const double half_x = half_of(arm.opening_width), half_y = half_of(arm.opening_height);
    const double radius = std::min({spec.shutter_radius * unit, half_x, half_y});
    const double softness = std::max(spec.shutter_softness * unit, 1e-6);
    const double inner_x = half_x - radius, inner_y = half_y - radius;
    for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
            const double x = std::max(std::abs(i + 0.5 - 0.5 * width) - inner_x, 0.0);
            const double y = std::max(std::abs(j + 0.5 - 0.5 * height) - inner_y, 0.0);
            const double outside = std::sqrt(x * x + y * y) - radius;  // [pixels]
            const double t = std::clamp(0.5 - outside / (2.0 * softness), 0.0, 1.0);
            open.values[static_cast<std::size_t>(j) * width + i] =
                static_cast<float>(t * t * (3.0 - 2.0 * t));
        }
    }
    return open;
}

Display::Display(const DisplaySpec& spec, const Field& expected, const Field& flat, const Field& weight,
                 Field open)
    : reference_(expected.width, expected.height),
      lift_(expected.width, expected.height),
      open_(std::move(open)) {
    assert(expected.values.size() == flat.values.size() && flat.values.size() == weight.values.size());
    const auto steps = static_cast<int>(grey_.size());
    for (int i = 0; i < steps; ++i) {
        const double d = lowest + (highest - lowest) * (i + 0.5) / steps;
        // A film-like curve: straight in the middle, gentle toward black and white.
        const double curve =
            1.0 / (1.0 + (1.0 - spec.brightness) / spec.brightness * std::exp(-spec.contrast * d));
        grey_[i] = static_cast<std::uint8_t>(std::lround(255.0 * curve));
    }

    Field log(expected.width, expected.height);
    double sum = 0.0, total = 0.0;
    for (std::size_t i = 0; i < log.values.size(); ++i) {
        lift_.values[i] = lift_of(expected.values[i]);
        log.values[i] = std::log((expected.values[i] + lift_.values[i]) / flat.values[i]);
        sum += static_cast<double>(weight.values[i]) * log.values[i];
        total += weight.values[i];
    }
    const auto middle = static_cast<float>(total > 0.0 ? sum / total : 0.0);
    const int block = std::max(1, expected.width / 128);
    const Field slow =
        enlarge(gaussian_blur(shrink(log, block), spec.compression_reach * expected.width / block), block,
                expected.width, expected.height);
    const double range = range_of(slow, open_);
    const auto fraction =
        static_cast<float>(std::max(spec.compression, range > spec.range ? 1.0 - spec.range / range : 0.0));
    for (std::size_t i = 0; i < log.values.size(); ++i) {
        reference_.values[i] = middle + fraction * (slow.values[i] - middle) + std::log(flat.values[i]);
    }
}

GrayImage Display::show(const Field& signal) const {
    assert(signal.values.size() == reference_.values.size());
    GrayImage image{signal.width, signal.height, std::vector<std::uint8_t>(signal.values.size())};
    const FastLog& log = fast_log();
    const auto steps = static_cast<int>(grey_.size());
    const float scale = static_cast<float>(steps) / (highest - lowest);
    constexpr std::size_t together = FastLog::together;
    std::array<float, together> level;
    std::array<int, together> step;
    for (std::size_t start = 0; start < signal.values.size(); start += together) {
        const std::size_t count = std::min(together, signal.values.size() - start);
        const float *const read = signal.values.data() + start, *const open = open_.values.data() + start;
        const float* const lift = lift_.values.data() + start;
        const float* const reference = reference_.values.data() + start;
        for (std::size_t i = 0; i < count; ++i) level[i] = std::max(read[i] + lift[i], 0.25f);
        log(std::span(level).first(count));
        for (std::size_t i = 0; i < count; ++i) {
            const float d = std::min(std::max(level[i] - reference[i], lowest), highest);
            step[i] = std::min(static_cast<int>((d - lowest) * scale), steps - 1);
        }
        for (std::size_t i = 0; i < count; ++i) level[i] = grey_[step[i]];
        std::uint8_t* const shown = image.pixels.data() + start;
        for (std::size_t i = 0; i < count; ++i) {
            const float up = shutter_grey + open[i] * (level[i] - shutter_grey) + 0.5f;
            shown[i] = static_cast<std::uint8_t>(up);
        }
    }
    return image;
}

}  // namespace render
