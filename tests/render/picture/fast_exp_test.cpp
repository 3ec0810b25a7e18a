#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "render/picture/fast_math.h"

TEST(FastExp, IsTheExponentialToSingleDigits) {
    double largest = 0.0;
    for (float x = -87.0f; x < 88.0f; x += 0.0037f)
        largest = std::max(largest, std::abs(render::fast_exp(x) / std::exp(static_cast<double>(x)) - 1.0));
    EXPECT_LT(largest, 2e-7);
    EXPECT_EQ(render::fast_exp(0.0f), 1.0f);
    for (float x : {-89.0f, -200.0f, -1e6f}) EXPECT_EQ(render::fast_exp(x), 0.0f) << x;
}

TEST(FastLog, OfManyIsThatOfEachToTheBit) {
    std::vector<float> values = {1.2e-38f, 1e-3f, 0.25f, 1.0f, 2.0f, 3e38f};
    for (float x = 0.3f; values.size() < render::FastLog::together; x *= 1.07f) values.push_back(x);
    std::vector<float> logs = values;
    render::fast_log()(logs);
    for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_EQ(logs[i], render::fast_log()(values[i])) << values[i];
        EXPECT_NEAR(logs[i], std::log(values[i]), 3e-4) << values[i];
    }
}
