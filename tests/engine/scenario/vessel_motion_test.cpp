#include <cmath>
#include <gtest/gtest.h>

#include "engine/scenario/breathing.h"

namespace scenario {

TEST(VesselMotion, RestsAtTimeZeroAndReachesItsEnds) {
    EXPECT_EQ(contraction(0, 60), 0);
    EXPECT_NEAR(contraction(1.0 / 3, 60), 1, 1e-12);
    EXPECT_NEAR(contraction(1, 60), 0, 1e-12);
    EXPECT_NEAR(inspiration(2, 15), 1, 1e-12);
    EXPECT_NEAR(inspiration(4, 15), 0, 1e-12);
}

TEST(VesselMotion, ExpirationLastsLongerThanInspiration) {
    int low = 0, high = 0;
    for (int i = 0; i < 1000; ++i) {
        const double place = inspiration(4e-3 * i, 15);
        low += place < 0.25;
        high += place > 0.75;
    }
    EXPECT_GT(low, 1.5 * high);
}

TEST(VesselMotion, TheBowelCarriesItsGasAndBringsItBack) {
    EXPECT_EQ(peristalsis(0), 0);
    EXPECT_NEAR(peristalsis(30), 1, 1e-12);
    for (int k = 0; k < 900; ++k) {
        ASSERT_LE(std::abs(peristalsis(0.1 * k + 0.1) - peristalsis(0.1 * k)), 0.006) << "it is slow";
        ASSERT_GE(peristalsis(0.1 * k), 0);
    }
}

TEST(VesselMotion, AddsHeartAndBreath) {
    VesselMotion motion;
    EXPECT_FALSE(motion.moves());
    EXPECT_EQ(motion.at(0.3), geometry::Vec3::Zero());
    motion.heart_reach = {0, 2, 3};
    motion.breathing_reach = {0, 0, -10};
    EXPECT_TRUE(motion.moves());
    const double t = 1.7;
    const geometry::Vec3 expected(0, 2 * contraction(t, 70),
                                  3 * contraction(t, 70) - 10 * inspiration(t, 15));
    EXPECT_NEAR((motion.at(t) - expected).norm(), 0, 1e-12);
}

}  // namespace scenario
