#pragma once
/// Exponentials of whole images.

#include <algorithm>
#include <bit>
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

}  // namespace render
