#pragma once
/// The difference between a frame and its golden, and between a score and the expected one.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "render/picture/image.h"

namespace test {

constexpr int tile_width = 16;  // [pixels]

/// Values by the names of limits.json [grey levels of 255].
using Measures = std::map<std::string, double>;

/// Compares the images whole, by tiles, and over the pixels where `wire` is not 0. Throws
/// std::invalid_argument when the sizes differ.
inline Measures compare(const render::GrayImage& golden, const render::GrayImage& actual,
                        const render::GrayImage& wire) {
    const render::ImageDifference whole = render::difference(golden, actual);
    const int width = golden.width, height = golden.height;
    const int tiles_across = (width + tile_width - 1) / tile_width;
    std::map<int, std::pair<double, int>> tiles;  // sum and number of pixels
    double wire_sum = 0, wire_signed = 0, wire_largest = 0;
    int wire_pixels = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(y) * width + x;
            const double off = static_cast<double>(actual.pixels[i]) - golden.pixels[i];
            auto& [sum, pixels] = tiles[y / tile_width * tiles_across + x / tile_width];
            sum += std::abs(off);
            ++pixels;
            if (wire.pixels.at(i) == 0) continue;
            wire_sum += std::abs(off);
            wire_signed += off;
            wire_largest = std::max(wire_largest, std::abs(off));
            ++wire_pixels;
        }
    }
    double tile = 0;
    for (const auto& [place, content] : tiles) tile = std::max(tile, content.first / content.second);
    const double all = std::max(wire_pixels, 1);
    return {{"mean_difference", whole.mean},
            {"largest_difference", whole.largest},
            {"tile_difference", tile},
            {"wire_difference", wire_sum / all},
            {"wire_bias", std::abs(wire_signed) / all},
            {"wire_largest", wire_largest}};
}

/// The values beyond their limits, each as "tile_difference 0.38 > 0.2"; empty when the frame may pass.
inline std::vector<std::string> beyond(const Measures& limits, const Measures& found) {
    std::vector<std::string> wrong;
    for (const auto& [name, value] : found)
        if (!(value <= limits.at(name)))
            wrong.push_back(fmt::format("{} {:.3g} > {:g}", name, value, limits.at(name)));
    return wrong;
}

/// Every value of two scores that differs, nested ones by their path; numbers with a fraction may be off by
/// the tolerance times 1 + the value. Empty when they agree.
inline std::vector<std::string> score_differences(const nlohmann::json& expected,
                                                  const nlohmann::json& actual, double tolerance) {
    const nlohmann::json flat = expected.flatten(), other = actual.flatten();
    std::vector<std::string> wrong;
    for (const auto& [path, value] : flat.items()) {
        const auto found = other.find(path);
        if (found == other.end()) {
            wrong.push_back(path + " is missing");
            continue;
        }
        const bool numbers = value.is_number_float() && found->is_number();
        const bool same = numbers ? std::abs(found->get<double>() - value.get<double>()) <=
                                        tolerance * (1 + std::abs(value.get<double>()))
                                  : *found == value;
        if (!same) wrong.push_back(fmt::format("{}: {} instead of {}", path, found->dump(), value.dump()));
    }
    for (const auto& [path, value] : other.items())
        if (!flat.contains(path)) wrong.push_back(path + " is new");
    return wrong;
}

/// |a − b| of images of one size, eight times as large and clipped, for inspecting a failed frame.
inline render::GrayImage difference_image(const render::GrayImage& a, const render::GrayImage& b) {
    render::GrayImage result = a;
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
        result.pixels[i] =
            static_cast<std::uint8_t>(std::min(8 * std::abs(int(a.pixels[i]) - int(b.pixels[i])), 255));
    return result;
}

}  // namespace test
