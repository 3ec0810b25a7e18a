#pragma once
/// Images that do not compress.

#include <cstdint>

#include "render/image.h"

namespace render::test {

inline GrayImage noisy(int width, int height) {
    GrayImage image{width, height, {}};
    std::uint32_t x = 1;
    for (int i = 0; i < width * height; ++i) {
        x = x * 1664525u + 1013904223u;
        image.pixels.push_back(static_cast<std::uint8_t>(x >> 24));
    }
    return image;
}

}  // namespace render::test
