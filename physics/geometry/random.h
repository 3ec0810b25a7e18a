#pragma once
/// Random numbers and hashes of text that are the same on every machine. Not for secrets.

#include <cstdint>
#include <string_view>

namespace geometry {

/// 2⁶⁴ over the golden ratio: the step between the states of splitmix64.
constexpr std::uint64_t golden_step = 0x9e3779b97f4a7c15ull;

/// The finaliser of splitmix64 (Steele, Lea and Flood 2014; constants of Stafford's variant 13): every bit of
/// the result depends on every bit.
constexpr std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ z >> 27) * 0x94d049bb133111ebull;
    return z ^ z >> 31;
}

/// The 64-bit FNV-1a hash of bytes, continued from that of the bytes before them.
constexpr std::uint64_t fnv1a(std::string_view bytes, std::uint64_t before = 14695981039346656037ull) {
    for (const char c : bytes) before = (before ^ static_cast<unsigned char>(c)) * 1099511628211ull;
    return before;
}

/// splitmix64.
class Random {
public:
    explicit constexpr Random(std::uint64_t state) : state_(state) {}
    /// Uniform from 0 up to but not including 1, in steps of 2⁻⁵³.
    constexpr double operator()() {
        return static_cast<double>(mixed(state_ += golden_step) >> 11) * 0x1p-53;
    }
    constexpr double between(double low, double high) { return low + (high - low) * (*this)(); }

private:
    std::uint64_t state_;
};

}  // namespace geometry
