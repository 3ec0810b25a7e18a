#pragma once
/// Logarithms of whole images.

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>

namespace render {

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
