#include <cmath>
#include <gtest/gtest.h>

#include "render/picture/resample.h"

namespace {

/// Waves of some 12 and 17 pixels.
render::Field waves(double x, double y) {
    render::Field field(70, 50);
    for (int j = 0; j < 50; ++j)
        for (int i = 0; i < 70; ++i)
            field.values[j * 70 + i] =
                static_cast<float>(2 + std::sin(0.52 * (i - x) + 0.1 * (j - y)) + std::cos(0.37 * (j - y)));
    return field;
}

}  // namespace

TEST(Shift, WholePixelsKeepEveryValueAndRepeatTheEdge) {
    const render::Field field = waves(0, 0), moved = render::shifted(field, 3, -2);
    for (int j = 0; j < 50; ++j)
        for (int i = 0; i < 70; ++i)
            ASSERT_EQ(moved.values[j * 70 + i], field.values[std::min(j + 2, 49) * 70 + std::max(i - 3, 0)]);
    EXPECT_EQ(render::shifted(field, 0, 0).values, field.values);
}

TEST(Shift, PartsOfAPixelAreInterpolated) {
    for (const double x : {0.5, -1.25, 7.9}) {
        const double y = 0.3 - 0.4 * x;
        const render::Field moved = render::shifted(waves(0, 0), x, y), expected = waves(x, y);
        double largest = 0;
        for (int j = 12; j < 38; ++j)
            for (int i = 12; i < 58; ++i)
                largest = std::max<double>(largest,
                                           std::abs(moved.values[j * 70 + i] - expected.values[j * 70 + i]));
        EXPECT_LT(largest, 0.01) << x;  // a mean of neighbours is off by 0.03
    }
}

TEST(Shift, FartherThanTheFieldLeavesItsEdge) {
    const render::Field field = waves(0, 0), moved = render::shifted(field, 1e9, 0);
    for (int i = 0; i < 70; ++i) ASSERT_EQ(moved.values[7 * 70 + i], field.values[7 * 70]);
    EXPECT_TRUE(render::shifted(render::Field(), 1, 1).values.empty());
}
