#include "render/xray/detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "physics/geometry/random.h"
#include "render/picture/filter.h"

namespace render {
namespace {

constexpr float fewest_for_normal = 25.0f;    // quanta
constexpr float fewest_for_expansion = 4.0f;  // quanta

/// Normal quantiles at the middle of 4096 equal fractions, scaled so that the sum of two has variance 1: one
/// lookup alone would end at 3.7 standard deviations and be visibly discrete.
const std::array<float, 4096>& quantiles() {
    static const std::array<float, 4096> table = [] {
        constexpr int count = 4096;
        std::array<double, count> exact{};
        double x = 0.0, square = 0.0;
        for (int i = count / 2; i < count; ++i) {
            const double above = 1.0 - (i + 0.5) / count;
            for (int newton = 0; newton < 12; ++newton) {
                const double tail = 0.5 * std::erfc(x / std::numbers::sqrt2);
                const double density = std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
                x += (tail - above) / density;
            }
            exact[i] = x;
            exact[count - 1 - i] = -x;
            square += 2.0 * x * x;
        }
        const double scale = 1.0 / std::sqrt(2.0 * square / count);
        std::array<float, count> result{};
        for (int i = 0; i < count; ++i) result[i] = static_cast<float>(exact[i] * scale);
        return result;
    }();
    return table;
}

/// A standard normal number from one half of the bits.
float normal_from(const std::array<float, 4096>& table, std::uint64_t bits, int which) {
    const std::uint64_t own = bits >> (which == 0 ? 0 : 32);
    return table[own & 4095] + table[(own >> 12) & 4095];
}

/// A Poisson count by inversion of the cumulative distribution.
float poisson(float mean, std::uint64_t bits) {
    const double uniform = (static_cast<double>(bits & 0xFFFFFFFFull) + 0.5) / 4294967296.0;
    double term = std::exp(-static_cast<double>(mean)), sum = term;
    int count = 0;
    while (uniform > sum && count < 200) {
        ++count;
        term *= mean / count;
        sum += term;
    }
    return static_cast<float>(count);
}

/// A count for a mean of at least fewest_for_expansion, from a standard normal number: above
/// fewest_for_normal that number scaled, below the expansion of the inverse Poisson distribution (M. B.
/// Giles, ACM Trans. Math. Softw. 42 (2016) 7, Q_N2), rounded down.
float count_from(float mean, float normal) {
    const float root = std::sqrt(mean), square = normal * normal;
    const float scaled = mean + root * normal;
    const float expanded =
        scaled + (1.0f / 3 + square * (1.0f / 6)) - normal * (1.0f / 36 + square * (1.0f / 72)) / root;
    // The conversion rounds down, as the number is not negative; few quanta never become a hundred.
    const auto whole = static_cast<float>(static_cast<int>(std::min(std::max(0.0f, expanded), 100.0f)));
    return mean < fewest_for_normal ? whole : scaled;
}

}  // namespace

PixelNoise::PixelNoise(std::uint64_t seed, std::uint64_t frame)
    : key_(geometry::mixed(geometry::mixed(seed + geometry::golden_step) ^
                           (frame * geometry::golden_step + 1))) {}

std::uint64_t PixelNoise::bits(std::uint64_t pixel) const {
    return geometry::mixed(key_ + (pixel + 1) * geometry::golden_step);
}

float PixelNoise::normal(std::uint64_t bits, int which) {
    return normal_from(quantiles(), bits, which);
}

float PixelNoise::quanta(float mean, std::uint64_t bits) {
    if (!(mean > 0.0f)) return 0.0f;
    if (mean < fewest_for_expansion) return poisson(mean, bits);
    return count_from(mean, normal(bits, 0));
}

Field read_out(Field expected, double pixel_width, const DetectorSpec& detector, std::uint64_t seed,
               std::uint64_t frame) {
    const PixelNoise noise(seed, frame);
    const double sigma = detector.scintillator_blur / pixel_width;
    const auto electronic = static_cast<float>(detector.electronic_noise);
    const auto& table = quantiles();
    const std::size_t width = expected.width;
    // A pixel's bits are used twice: the part for the electronics waits until the row has been blurred.
    const int waiting = blur_reach(sigma) + 1;
    std::vector<float> counted(width), added(waiting * width);
    const auto added_to = [&](int row) { return added.data() + row % waiting * width; };
    const auto count = [&](int row, std::span<float> values) {
        const std::size_t first = static_cast<std::size_t>(row) * width;
        float* const later = added_to(row);
        for (std::size_t i = 0; i < width; ++i) {
            const std::uint64_t bits = noise.bits(first + i);
            counted[i] = normal_from(table, bits, 0);
            later[i] = normal_from(table, bits, 1);
        }
        int few = 0, fewest = 0;  // pixels that need more than a scaled number, or the distribution itself
        for (const float mean : values) {
            few += mean >= fewest_for_normal ? 0 : 1;
            fewest += mean >= fewest_for_expansion ? 0 : 1;
        }
        if (fewest > 0) {
            for (std::size_t i = 0; i < width; ++i)
                values[i] = PixelNoise::quanta(values[i], noise.bits(first + i));
        } else if (few > 0) {
            for (std::size_t i = 0; i < width; ++i) values[i] = count_from(values[i], counted[i]);
        } else {
            for (std::size_t i = 0; i < width; ++i) values[i] += std::sqrt(values[i]) * counted[i];
        }
    };
    const auto add = [&](int row, std::span<float> values) {
        const float* const own = added_to(row);
        for (std::size_t i = 0; i < width; ++i) values[i] += electronic * own[i];
    };
    blur(expected, sigma, count, electronic > 0.0f ? ForRow(add) : ForRow());
    return expected;
}

}  // namespace render
