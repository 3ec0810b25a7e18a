#include "render/display.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>

#include "render/filter.h"

namespace render {

namespace {

constexpr float lowest = -4.0f, highest = 3.0f;  // ln of signal over reference that the grey table covers
constexpr float black = 5.0f;                    // grey of the closed shutters

/// Natural logarithm of a positive, normal float to 3e-4: its exponent, and a table over 11 bits of its
/// mantissa.
class FastLog {
public:
    FastLog() {
        for (int i = 0; i < size; ++i) mantissa_[i] = static_cast<float>(std::log1p((i + 0.5) / size));
    }
    float operator()(float x) const {
        const auto bits = std::bit_cast<std::uint32_t>(x);
        const int exponent = static_cast<int>(bits >> 23) - 127;
        return static_cast<float>(exponent) * std::numbers::ln2_v<float> + mantissa_[bits >> 12 & (size - 1)];
    }

private:
    static constexpr int size = 2048;
    std::array<float, size> mantissa_{};
};

const FastLog& fast_log() {
    static const FastLog log;
    return log;
}

}  // namespace

Field shutters(const DisplaySpec& spec, int width, int height) {
    Field open(width, height);
    const double unit = std::min(width, height);
    const double radius = spec.shutter_radius * unit;
    const double softness = std::max(spec.shutter_softness * unit, 1e-6);
    const double inner_x = 0.5 * width - spec.shutter_margin * unit - radius;
    const double inner_y = 0.5 * height - spec.shutter_margin * unit - radius;
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

Display::Display(const DisplaySpec& spec, const Field& expected, const Field& flat, const Field& weight)
    : reference_(expected.width, expected.height), open_(shutters(spec, expected.width, expected.height)) {
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
        log.values[i] = std::log(std::max(expected.values[i], 1e-3f) / flat.values[i]);
        sum += static_cast<double>(weight.values[i]) * log.values[i];
        total += weight.values[i];
    }
    const auto middle = static_cast<float>(total > 0.0 ? sum / total : 0.0);
    constexpr int block = 8;
    const Field slow =
        enlarge(gaussian_blur(shrink(log, block), spec.compression_reach * expected.width / block), block,
                expected.width, expected.height);
    const auto share = static_cast<float>(spec.compression);
    for (std::size_t i = 0; i < log.values.size(); ++i) {
        reference_.values[i] = middle + share * (slow.values[i] - middle) + std::log(flat.values[i]);
    }
}

GrayImage Display::show(const Field& signal) const {
    assert(signal.values.size() == reference_.values.size());
    GrayImage image{signal.width, signal.height, std::vector<std::uint8_t>(signal.values.size())};
    const FastLog& log = fast_log();
    const auto steps = static_cast<int>(grey_.size());
    const float scale = static_cast<float>(steps) / (highest - lowest);
    for (std::size_t i = 0; i < signal.values.size(); ++i) {
        const float d = log(std::max(signal.values[i], 0.25f)) - reference_.values[i];
        const int step = static_cast<int>((std::clamp(d, lowest, highest) - lowest) * scale);
        const float grey = grey_[std::min(step, steps - 1)];
        image.pixels[i] = static_cast<std::uint8_t>(black + open_.values[i] * (grey - black) + 0.5f);
    }
    return image;
}

}  // namespace render
