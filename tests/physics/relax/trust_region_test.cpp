#include "physics/relax/trust_region.h"

#include <cmath>
#include <gtest/gtest.h>

using physics::TrustOptions, physics::TrustRegion;

namespace {

TrustRegion region(double mu, double unit = 1) {
    TrustRegion trust{TrustOptions()};
    trust.set_unit(unit);
    trust.set(mu);
    trust.begin_step();
    return trust;
}

/// Trials until one fits, of a wire whose reach is 1/(a + bμ) caps.
int trials(TrustRegion& trust, double a, double b) {
    trust.begin_step();
    for (int trial = 0; trial < 100; ++trial) {
        const double reach = 1 / (a + b * trust.mu());
        if (reach <= 1) return trial;
        trust.too_far(reach, trial == 0, false);
    }
    return 100;
}

}  // namespace

TEST(TrustRegion, FindsAStepThatJustFits) {
    for (const double a : {0.5, 0.1, 1e-3})
        for (const double b : {1e-3, 1.0, 1e6}) {
            TrustRegion trust = region(0);
            EXPECT_LE(trials(trust, a, b), 14) << a << " " << b;
            EXPECT_LE(1 / (a + b * trust.mu()), 1) << a << " " << b;
            EXPECT_GT(1 / (a + b * trust.mu()), 1.0 / 30) << a << " " << b;
        }
}

TEST(TrustRegion, TheSecantMeetsAStraightLine) {
    TrustRegion trust = region(1);
    EXPECT_EQ(trials(trust, 0.1, 0.05), 2);  // a guess, then the line through both
    EXPECT_NEAR(1 / (0.1 + 0.05 * trust.mu()), 0.8, 1e-12);
}

TEST(TrustRegion, IsFiniteWhereTheTrialIsNot) {
    TrustRegion trust = region(0, 2);
    const double least = TrustOptions().least_fraction * 2.0;
    trust.too_far(std::nan(""), true, false);
    EXPECT_DOUBLE_EQ(trust.mu(), least);
    trust.too_far(std::numeric_limits<double>::infinity(), false, false);
    EXPECT_TRUE(std::isfinite(trust.mu()));
    EXPECT_GT(trust.mu(), least);
}

TEST(TrustRegion, LooksBetweenTooSoftAndTooStiff) {
    TrustRegion trust = region(1);
    EXPECT_FALSE(trust.too_short(0.001));  // nothing is known to be too soft
    trust.too_far(100, false, false);
    const double stiff = trust.mu();
    EXPECT_FALSE(trust.too_short(0.5));  // far enough
    EXPECT_TRUE(trust.too_short(0.001));
    EXPECT_GT(trust.mu(), 1);
    EXPECT_LT(trust.mu(), stiff);
    // It ends, with a μ that is known to fit or near to it.
    int tries = 0;
    while (trust.too_short(0.001)) ++tries;
    EXPECT_LE(tries, 5);
}

TEST(TrustRegion, GrowsWhereEveryTrialIsTooShortOrTooFar) {
    // A step too short that its corrected wall sends too far: no μ between them is left to try.
    TrustRegion trust = region(1);
    trust.too_far(100, false, false);
    for (int k = 0; k < 3; ++k) {
        while (trust.too_short(0.001)) {
        }
        const double mu = trust.mu();
        trust.too_far(8, false, true);
        EXPECT_GT(trust.mu(), mu) << k;
    }
}

TEST(TrustRegion, AStepThatFirstWentTooFarSaysWhatTheNextOneNeeds) {
    // The whole step reaches ten caps, and all fit from 2.25 on: the secant aims at 1/(0.1 + 0.4 μ) = 0.8.
    TrustRegion trust = region(0);
    EXPECT_GT(trials(trust, 0.1, 0.4), 0);
    trust.accepted(1 / (0.1 + 0.4 * trust.mu()), false);
    EXPECT_NEAR(1 / (0.1 + 0.4 * trust.mu()), 0.8, 1e-9);
    EXPECT_EQ(trials(trust, 0.1, 0.4), 0);
}

TEST(TrustRegion, OpensAfterAStepThatFitsAndIsForgottenWhereItIsSmall) {
    const TrustOptions o;
    TrustRegion trust = region(1);
    trust.accepted(0.5, false);
    EXPECT_DOUBLE_EQ(trust.mu(), 0.25);
    trust.accepted(0, true);
    EXPECT_DOUBLE_EQ(trust.mu(), 0.25 * o.cautious_shrink);
    trust.set(o.forgotten_fraction);
    trust.accepted(0.5, false);
    EXPECT_EQ(trust.mu(), 0);
    trust.rejected();
    EXPECT_DOUBLE_EQ(trust.mu(), o.rejected_fraction);
    trust.crawled();
    EXPECT_DOUBLE_EQ(trust.mu(), o.first_growth * o.rejected_fraction);
    EXPECT_TRUE(trust.moves_joints());
    trust.set(2 * o.most_fraction);
    EXPECT_FALSE(trust.moves_joints());
}
