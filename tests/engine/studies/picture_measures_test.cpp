/// Measures of pictures on pictures whose measures are known.

#include "engine/studies/picture_measures.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "render/picture/filter.h"

namespace studies {
namespace {

render::Field white_noise(int size, double sigma, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> draw(0, static_cast<float>(sigma));
    render::Field field(size, size, 100);
    for (float& value : field.values) value += draw(random);
    return field;
}

/// Dark disc of a radius, its edge blurred by σ [pixels].
render::Field disc(int size, double radius, double sigma) {
    render::Field field(size, size, 100);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            if (std::hypot(x - size / 2, y - size / 2) < radius) field.values[y * size + x] = 40;
    render::blur(field, sigma);
    return field;
}

}  // namespace

TEST(PictureMeasures, NoiseIsTheStandardDeviationOfWhiteNoiseOnAnySlope) {
    for (const double sigma : {0.5, 2.0, 7.0}) {
        render::Field field = white_noise(256, sigma, 3);
        EXPECT_NEAR(noise_of(field), sigma, 0.02 * sigma);
        for (int y = 0; y < 256; ++y)
            for (int x = 0; x < 256; ++x) field.values[y * 256 + x] += 0.3f * x - 0.2f * y;
        EXPECT_NEAR(noise_of(field), sigma, 0.02 * sigma);
    }
}

TEST(PictureMeasures, DarkLinesAreAsDeepAsTheyAre) {
    render::Field field(200, 200, 150);
    for (int y = 0; y < 200; ++y)
        for (int x = 60; x < 68; ++x) field.values[y * 200 + x] = 97;
    const render::Field depth = depth_of_dark(field, 15);
    EXPECT_EQ(percentile(depth, 0.99), 53);
    EXPECT_EQ(percentile(depth, 0.9), 0);
    EXPECT_EQ(inner_part(field, 0.25).width, 100);
    EXPECT_EQ(inner_part(field, 0.25).values[10], 97);
}

TEST(PictureMeasures, EdgesAreAsWideAsTheyWereBlurred) {
    constexpr double pixel = 0.3, own = 0.7;  // the measure blurs by 0.7 pixels itself
    for (const double sigma : {1.5, 3.0, 5.0}) {
        const double wanted = 2 * 1.2816 * std::hypot(sigma, own) * pixel;
        const Structure found = structure_of(disc(512, 150, sigma), pixel);
        EXPECT_NEAR(found.edges[1], wanted, 0.12 * wanted) << sigma;
    }
}

TEST(PictureMeasures, OctavesOfWhiteNoiseDoubleTowardFinerAndItsPowerIsEven) {
    const Structure found = structure_of(white_noise(512, 5, 7), 0.2);
    for (std::size_t k = 1; k < octaves.size(); ++k)
        EXPECT_NEAR(found.power[k] / found.power[k - 1], 0.5, 0.08) << k;
    EXPECT_GT(found.evenness, 0.85);
    // Of normal values those beyond 2.326 σ hold 2 · (2.326 φ(2.326) + 0.01) = 14 % of the power.
    EXPECT_NEAR(found.strongest, 0.144, 0.02);
}

TEST(PictureMeasures, LinesOnNothingAreUneven) {
    const Structure lines = structure_of(disc(512, 150, 1), 0.3);
    EXPECT_GT(lines.strongest, 0.8);
    EXPECT_LT(lines.evenness, 0.1);
    EXPECT_THROW(structure_of(white_noise(64, 1, 1), 0.3), std::invalid_argument);
}

TEST(PictureMeasures, RidgesAreAsLongAsTheirLines) {
    constexpr double pixel = 0.2, apart_across = 5, apart_along = 10, half_width = 0.3;  // [mm]
    constexpr int size = 400;
    render::Field grid(size, size, 0);
    const auto profile = [](double at, double apart) {
        const double off = std::remainder(at - 2.5, apart);
        return std::exp(-off * off / (2 * half_width * half_width));
    };
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            grid.values[static_cast<std::size_t>(y) * size + x] = static_cast<float>(
                std::max(profile(y * pixel, apart_across), profile(x * pixel, apart_along)));
    std::vector<std::uint8_t> area(grid.values.size(), 1);
    const Ridges found = ridges_of(grid, pixel, area);
    EXPECT_NEAR(found.length, 100 * (1 / apart_across + 1 / apart_along), 2);
    const double crossings = 100 / (apart_across * apart_along);
    EXPECT_GE(found.branches, crossings);
    EXPECT_LE(found.branches, 3.1 * crossings);
    // The unit of the picture does not matter, nor does what lies outside.
    for (float& value : grid.values) value *= 7;
    for (std::size_t k = 0; k < area.size(); ++k) area[k] = k < area.size() / 2;
    EXPECT_NEAR(ridges_of(grid, pixel, area).length, found.length, 2);
    EXPECT_EQ(ridges_of(grid, pixel, std::vector<std::uint8_t>(area.size(), 0)).length, 0);
}

}  // namespace studies
