#include "render/picture/filter.h"

#include <gtest/gtest.h>
#include <numeric>

namespace {

using render::Field;

TEST(Filter, BlurKeepsTheSumAndSpreadsByItsDeviation) {
    Field point(41, 41);
    point.values[20 * 41 + 20] = 1.0f;
    const Field spread = render::gaussian_blur(point, 2.0);
    double sum = 0.0, square = 0.0;
    for (int j = 0; j < 41; ++j) {
        for (int i = 0; i < 41; ++i) {
            sum += spread.values[j * 41 + i];
            square += spread.values[j * 41 + i] * (i - 20) * (i - 20);
        }
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_NEAR(square, 4.0 + 1.0 / 12.0,
                0.1);  // the pixel's own width adds 1/12; the cut tail takes a little
    EXPECT_EQ(render::gaussian_blur(point, 0.0).values, point.values);
}

TEST(Filter, BlurLeavesAConstantAloneUpToTheBorder) {
    for (float v : render::gaussian_blur(Field(9, 5, 3.0f), 1.3).values) EXPECT_NEAR(v, 3.0f, 1e-5f);
}

TEST(Filter, BlurTakesEachRowOnceBeforeAndOnceWhenItIsDone) {
    for (const double sigma : {0.0, 0.3, 1.3}) {
        for (const int height : {1, 2, 3, 12}) {
            Field rows(7, height), raised(7, height);
            for (std::size_t i = 0; i < rows.values.size(); ++i)
                rows.values[i] = static_cast<float>(i * i % 19);
            for (std::size_t i = 0; i < rows.values.size(); ++i) raised.values[i] = rows.values[i] + 2.0f;
            render::blur(raised, sigma);
            for (float& value : raised.values) value *= 3.0f;
            int begun = 0, done = 0;
            render::blur(
                rows, sigma,
                [&](int row, std::span<float> values) {
                    EXPECT_EQ(row, begun++);
                    for (float& value : values) value += 2.0f;
                },
                [&](int row, std::span<float> values) {
                    EXPECT_EQ(row, done++);
                    EXPECT_LE(begun - row - 1, render::blur_reach(sigma));
                    for (float& value : values) value *= 3.0f;
                });
            EXPECT_EQ(done, height);
            EXPECT_EQ(rows.values, raised.values) << sigma << ", " << height << " rows";
        }
    }
}

TEST(Filter, BlurTreatsRowsColumnsAndAllFourBordersAlike) {
    Field uneven(17, 17), turned(17, 17), mirrored(17, 17);
    for (int j = 0; j < 17; ++j) {
        for (int i = 0; i < 17; ++i) {
            const float v = static_cast<float>((i * 7 + j * 13 + i * j) % 23);
            uneven.values[j * 17 + i] = v;
            turned.values[i * 17 + j] = v;
            mirrored.values[(16 - j) * 17 + (16 - i)] = v;
        }
    }
    const Field a = render::gaussian_blur(uneven, 1.4), b = render::gaussian_blur(turned, 1.4);
    const Field c = render::gaussian_blur(mirrored, 1.4);
    for (int j = 0; j < 17; ++j) {
        for (int i = 0; i < 17; ++i) {
            EXPECT_NEAR(a.values[j * 17 + i], b.values[i * 17 + j], 1e-4f);
            EXPECT_NEAR(a.values[j * 17 + i], c.values[(16 - j) * 17 + (16 - i)], 1e-4f);
        }
    }
}

TEST(Filter, EnlargingAShrunkSlopeGivesItBack) {
    Field slope(50, 35);
    for (int j = 0; j < 35; ++j) {
        for (int i = 0; i < 50; ++i) slope.values[j * 50 + i] = 2.0f * i - 3.0f * j;
    }
    const Field small = render::shrink(slope, 4);
    EXPECT_EQ(small.width, 13);
    EXPECT_EQ(small.height, 9);
    const Field back = render::enlarge(small, 4, 50, 35);
    for (int j = 4; j < 28; ++j) {
        for (int i = 4; i < 44; ++i) EXPECT_NEAR(back.values[j * 50 + i], slope.values[j * 50 + i], 1e-3f);
    }
}

}  // namespace
