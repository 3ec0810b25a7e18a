#include "render/xray/iodine_clouds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace render {
namespace {

/// Of one cloud. Its rays are taken for parallel: it is small against its distance from the source.
void add_cloud(const CArm& arm, const IodineCloud& cloud, Field& iodine, std::vector<std::uint32_t>& pixels) {
    constexpr double reach = 4;         // standard deviations
    constexpr double mg_per_ml = 1000;  // of 1 mg/mm³
    const Pixel middle = project(arm, cloud.middle);
    if (!(middle.depth > 0 && cloud.iodine > 0 && cloud.spread > 0)) return;
    const double pitch = pixel_width(arm) * middle.depth / arm.sid;  // of a pixel, where the cloud is [mm]
    const double spread = cloud.spread / pitch;                      // [pixels]
    // The mean over a pixel widens a distribution by that of the pixel, a twelfth of its width squared.
    const double variance = spread * spread + 1.0 / 12;
    const double along_middle =
        mg_per_ml * cloud.iodine / (2 * std::numbers::pi * variance * pitch * pitch);  // [mg/ml·mm]
    const double most = reach * std::sqrt(variance);
    const auto range = [&](double at) {
        const double first = std::clamp(std::floor(at - most), 0.0, static_cast<double>(arm.pixels)),
                     end = std::clamp(std::ceil(at + most), 0.0, static_cast<double>(arm.pixels));
        return std::pair(static_cast<int>(first), static_cast<int>(end));
    };
    const auto [left, right] = range(middle.x);
    const auto [top, bottom] = range(middle.y);
    for (int row = top; row < bottom; ++row) {
        const double down = row + 0.5 - middle.y;
        for (int column = left; column < right; ++column) {
            const double across = column + 0.5 - middle.x, square = across * across + down * down;
            if (square > most * most) continue;
            const auto index = static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(arm.pixels) +
                               static_cast<std::uint32_t>(column);
            float& there = iodine.values[index];
            if (there == 0.0f) pixels.push_back(index);
            there += static_cast<float>(along_middle * std::exp(-square / (2 * variance)));
        }
    }
}

}  // namespace

void add_clouds(const CArm& arm, std::span<const IodineCloud> clouds, Field& iodine,
                std::vector<std::uint32_t>& pixels) {
    for (const IodineCloud& cloud : clouds) add_cloud(arm, cloud, iodine, pixels);
}

std::vector<std::uint32_t> cloud_pixels(const CArm& arm, std::span<const IodineCloud> clouds, double above) {
    Field iodine(arm.pixels, arm.pixels);
    std::vector<std::uint32_t> pixels;
    add_clouds(arm, clouds, iodine, pixels);
    std::erase_if(pixels, [&](std::uint32_t pixel) { return iodine.values[pixel] <= above; });
    std::sort(pixels.begin(), pixels.end());
    pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
    return pixels;
}

}  // namespace render
