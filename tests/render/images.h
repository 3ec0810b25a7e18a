#pragma once
/// Images that several tests start from.

#include <cstdint>
#include <vector>

#include "render/picture/image.h"

namespace test {

inline render::GrayImage plain(int width, int height, std::uint8_t grey) {
    return {width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height, grey)};
}

/// An image that does not compress.
inline render::GrayImage noisy(int width, int height) {
    render::GrayImage image{width, height, {}};
    std::uint32_t x = 1;
    for (int i = 0; i < width * height; ++i) {
        x = x * 1664525u + 1013904223u;
        image.pixels.push_back(static_cast<std::uint8_t>(x >> 24));
    }
    return image;
}

}  // namespace test
