#include "physics/relax/trust_search.h"

#include <cmath>
#include <gtest/gtest.h>

using physics::TrustSearch;

namespace {

/// Trials until one fits, of a wire whose reach is 1/(a + bμ) caps.
int trials(double& mu, double a, double b) {
    TrustSearch search(mu, 1.0);
    for (int trial = 0; trial < 100; ++trial) {
        const double reach = 1 / (a + b * mu);
        if (reach <= 1) return trial;
        search.raise(reach, trial == 0, false);
    }
    return 100;
}

}  // namespace

TEST(TrustSearch, FindsAStepThatJustFits) {
    for (const double a : {0.5, 0.1, 1e-3})
        for (const double b : {1e-3, 1.0, 1e6}) {
            double mu = 0;
            EXPECT_LE(trials(mu, a, b), 14) << a << " " << b;
            EXPECT_LE(1 / (a + b * mu), 1) << a << " " << b;
            EXPECT_GT(1 / (a + b * mu), 1.0 / 30) << a << " " << b;
        }
}

TEST(TrustSearch, TheSecantMeetsAStraightLine) {
    double mu = 1;
    EXPECT_EQ(trials(mu, 0.1, 0.05), 2);  // a guess, then the line through both
    EXPECT_NEAR(1 / (0.1 + 0.05 * mu), 0.8, 1e-12);
}

TEST(TrustSearch, IsFiniteWhereTheTrialIsNot) {
    double mu = 0;
    TrustSearch search(mu, 2.0);
    search.raise(std::nan(""), true, false);
    EXPECT_DOUBLE_EQ(mu, physics::least_trust * 2.0);
    search.raise(std::numeric_limits<double>::infinity(), false, false);
    EXPECT_TRUE(std::isfinite(mu));
    EXPECT_GT(mu, physics::least_trust * 2.0);
}

TEST(TrustSearch, LooksBetweenTooSoftAndTooStiff) {
    double mu = 1;
    TrustSearch search(mu, 1.0);
    EXPECT_FALSE(search.lower(0.001));  // nothing is known to be too soft
    search.raise(100, false, false);
    const double stiff = mu;
    EXPECT_FALSE(search.lower(0.5));  // far enough
    EXPECT_TRUE(search.lower(0.001));
    EXPECT_GT(mu, 1);
    EXPECT_LT(mu, stiff);
    // It ends, with a μ that is known to fit or near to it.
    int tries = 0;
    while (search.lower(0.001)) ++tries;
    EXPECT_LE(tries, 5);
}
