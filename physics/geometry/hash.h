#pragma once
/// The hash of states and of places. File formats with a hash of their own keep that one.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "physics/geometry/vec.h"

namespace geometry {

/// Hashes a sequence of 64-bit words as FNV-1a hashes bytes, with the bits rotated in between so that each
/// reaches all others. The same on every machine of the same byte order. Not for secrets.
class Hash {
public:
    void add(std::uint64_t word) { state_ = std::rotl(state_ ^ word, 29) * 0x9e3779b97f4a7c15ull; }
    void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
    /// Pads the last word with zeros, so callers whose items vary in size must add the sizes first.
    void add(const void* data, std::size_t bytes) {
        const char* from = static_cast<const char*>(data);
        for (; bytes >= sizeof(std::uint64_t);
             from += sizeof(std::uint64_t), bytes -= sizeof(std::uint64_t)) {
            std::uint64_t word;
            std::memcpy(&word, from, sizeof word);
            add(word);
        }
        if (bytes == 0) return;
        std::uint64_t word = 0;
        std::memcpy(&word, from, bytes);
        add(word);
    }
    std::uint64_t value() const {
        std::uint64_t h = state_;
        h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93ull;
        h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93ull;
        return h ^ (h >> 32);
    }

private:
    std::uint64_t state_ = 14695981039346656037ull;
};

/// Hashes a place by its bits; −0 and 0 are the same.
struct PlaceHash {
    std::size_t operator()(const Vec3& place) const {
        Hash hash;
        for (int k = 0; k < 3; ++k) hash.add(place[k] + 0.0);
        return hash.value();
    }
};

}  // namespace geometry
