#pragma once
/// Exponentials and logarithms of whole images.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>

namespace render {

/// eˣ with a relative error of 2e-7, 0 below −88; x from −1e6 to 88. It has no branches, so that the compiler
/// computes four at a time, and uses only sums and products, so that every machine gets the same bits.
inline float fast_exp(float x) {
    // x = n·ln 2 + r, |r| ≤ ½ ln 2; ln 2 is split in two parts, and n times the first is exact.
    constexpr float ln2_high = 0.693359375f, ln2_low = -2.12194440e-4f;
    constexpr float to_whole = 12582912.0f;  // 1.5·2²³: adding it removes the fraction
    const float n = (x * std::numbers::log2e_v<float> + to_whole) - to_whole;
    const float r = (x - n * ln2_high) - n * ln2_low;
    float sum = 1.0f / 5040;
    sum = sum * r + 1.0f / 720;
    sum = sum * r + 1.0f / 120;
    sum = sum * r + 1.0f / 24;
    sum = sum * r + 1.0f / 6;
    sum = sum * r + 0.5f;
    sum = sum * r + 1.0f;
    sum = sum * r + 1.0f;
    const std::int32_t power = std::max(static_cast<std::int32_t>(n) + 127, 0) << 23;  // bits of 2ⁿ
    return sum * std::bit_cast<float>(power);
}

inline void exponentiate(std::span<float> values) {
    for (float& value : values) value = fast_exp(value);
}

/// Natural logarithm of a positive, normal float with an error of 3e-4: from its exponent, and a table over
/// 11 bits of its mantissa.
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
    /// Logarithms of all values, to the same bits: four at a time except for the table. At most `together`.
    static constexpr std::size_t together = 256;
    void operator()(std::span<float> values) const {
        std::array<std::uint32_t, together> place;
        const std::size_t count = values.size();
        for (std::size_t i = 0; i < count; ++i) {
            const auto bits = std::bit_cast<std::uint32_t>(values[i]);
            place[i] = bits >> 12 & (size - 1);
            values[i] = static_cast<float>(static_cast<int>(bits >> 23) - 127) * std::numbers::ln2_v<float>;
        }
        for (std::size_t i = 0; i < count; ++i) values[i] += mantissa_[place[i]];
    }

private:
    static constexpr int size = 2048;
    std::array<float, size> mantissa_{};
};

inline const FastLog& fast_log() {
    static const FastLog log;
    return log;
}

}  // namespace render
