#pragma once
/// Images as plain rows of numbers, row 0 at the top.

#include <cstdint>
#include <vector>

#include "physics/geometry/state.h"

namespace render {

/// The image as seen: 8-bit grey levels, width·height pixels.
struct GrayImage {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> pixels;

    bool operator==(const GrayImage&) const = default;
    void state(geometry::StateStream& s) { s(width, height, pixels); }
};

/// 65536 grey levels, for numbers rather than for the eye.
struct DeepImage {
    int width = 0;
    int height = 0;
    std::vector<std::uint16_t> pixels;

    bool operator==(const DeepImage&) const = default;
};

/// A coloured picture: red, green, blue of each pixel, 8 bits each; 3·width·height values.
struct ColourImage {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> pixels;

    bool operator==(const ColourImage&) const = default;
};

/// A number per pixel: path length [mm], quanta, logarithms.
struct Field {
    int width = 0;
    int height = 0;
    std::vector<float> values;

    void state(geometry::StateStream& s) { s(width, height, values); }
    Field() = default;
    Field(int columns, int rows, float value = 0.0f)
        : width(columns), height(rows), values(static_cast<std::size_t>(columns) * rows, value) {}
};

/// How far two images differ, in grey levels.
struct ImageDifference {
    double mean = 0.0;         // of |a − b| over all pixels
    double largest = 0.0;      // of |a − b|
    int pixels_differing = 0;  // by one level or more
};

/// Compares pixel by pixel. Throws std::invalid_argument when the sizes differ.
ImageDifference difference(const GrayImage& a, const GrayImage& b);

}  // namespace render
