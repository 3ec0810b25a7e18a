#include "render/xray/iodine_clouds.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

namespace render {
namespace {

/// Iodine that an image shows, by the width of its pixels at that depth [mg].
double shown(const CArm& arm, const Field& iodine, double depth) {
    const double pitch = pixel_width(arm) * depth / arm.sid;
    double sum = 0;
    for (const float value : iodine.values) sum += value;
    return sum * pitch * pitch / 1000;
}

}  // namespace

TEST(IodineClouds, ShowTheIodineThatIsInThemAtAnyAngleAndDistance) {
    for (const double lao : {0.0, 0.7})
        for (const double depth : {600.0, 750.0, 950.0})
            for (const double spread : {0.2, 1.0, 6.0}) {
                CArm arm;
                arm.lao = lao;
                arm.pixels = 256;
                arm.detector_width = 120;
                const IodineCloud cloud{source(arm) + depth * axes(arm).beam, spread, 40};
                Field iodine(arm.pixels, arm.pixels);
                std::vector<std::uint32_t> pixels;
                add_clouds(arm, {{cloud}}, iodine, pixels);
                EXPECT_NEAR(shown(arm, iodine, depth), 40, 0.01 * 40) << lao << " " << depth << " " << spread;
                // The ray through the middle of a normal distribution.
                const Pixel middle = project(arm, cloud.middle);
                const float most = iodine.values[static_cast<std::size_t>(middle.y) * 256 +
                                                 static_cast<std::size_t>(middle.x)];
                if (spread > 5) {
                    EXPECT_NEAR(most, 1000 * 40 / (2 * std::numbers::pi * spread * spread), 0.02 * most);
                }
                for (const std::uint32_t pixel : pixels) EXPECT_GT(iodine.values[pixel], 0);
            }
}

TEST(IodineClouds, OfNothingBehindTheSourceOrOutsideTheImageAddNothing) {
    CArm arm;
    arm.pixels = 64;
    Field iodine(64, 64);
    std::vector<std::uint32_t> pixels;
    const geometry::Vec3 ahead = source(arm) + 700 * axes(arm).beam;
    add_clouds(arm,
               std::vector<IodineCloud>{{ahead, 3, 0},
                                        {source(arm) - 50 * axes(arm).beam, 3, 10},
                                        {ahead + 900 * axes(arm).right, 3, 10}},
               iodine, pixels);
    EXPECT_TRUE(pixels.empty());
    EXPECT_TRUE(cloud_pixels(arm, {}, 3).empty());
    const std::vector<IodineCloud> two = {{ahead, 2, 10}, {ahead + 3 * axes(arm).right, 2, 10}};
    const std::vector<std::uint32_t> seen = cloud_pixels(arm, two, 3);
    EXPECT_FALSE(seen.empty());
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
    EXPECT_LT(cloud_pixels(arm, two, 300).size(), seen.size());
}

}  // namespace render
