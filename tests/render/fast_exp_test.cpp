#include "render/fast_exp.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

TEST(FastExp, IsTheExponentialToSingleDigits) {
    double largest = 0.0;
    for (float x = -87.0f; x < 88.0f; x += 0.0037f)
        largest = std::max(largest, std::abs(render::fast_exp(x) / std::exp(static_cast<double>(x)) - 1.0));
    EXPECT_LT(largest, 2e-7);
    EXPECT_EQ(render::fast_exp(0.0f), 1.0f);
    for (float x : {-89.0f, -200.0f, -1e6f}) EXPECT_EQ(render::fast_exp(x), 0.0f) << x;
}
