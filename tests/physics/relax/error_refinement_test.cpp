#include "physics/relax/error_refinement.h"

#include <gtest/gtest.h>
#include <numeric>

#include "tests/physics/refined_course.h"

using namespace physics;

namespace {

double true_error(const RefinedCourse& course) {
    return (finest(course.tube.chain, *course.tube.wall, 2).tip() - course.tube.chain.tip()).norm();
}

}  // namespace

TEST(ErrorRefinement, KeepsTipsWithinTheToleranceFromPushToPush) {
    constexpr double tolerance = 0.03;  // [mm]
    int rests = 0, within = 0, beyond_uniform = 0, split = 0;
    for (int seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        RefinedCourse course(seed, tolerance);
        for (int hand = 0; hand < course.tube.hands; ++hand) {
            course.push();
            ASSERT_TRUE(course.tube.at_rest) << "push " << hand;
            EXPECT_TRUE(validate(course.tube.chain).empty());
            if (hand % 4 != 3) continue;
            const double error = true_error(course);
            EXPECT_LE(error, 2 * tolerance) << "push " << hand;
            ++rests;
            within += error <= tolerance;
        }
        const RandomTube uniform(seed);
        beyond_uniform +=
            (finest(uniform.chain, *uniform.wall).tip() - uniform.chain.tip()).norm() > tolerance;
        split += course.split;
    }
    EXPECT_GE(within, 0.9 * rests) << within << " of " << rests;
    EXPECT_GE(beyond_uniform, 4) << "uniform ones are as good: this tests nothing";
    EXPECT_GT(split, 0);
}

TEST(ErrorRefinement, MergesOnlyWhatTheToleranceAllows) {
    constexpr double tolerance = 0.03;  // [mm]
    int merged = 0, costly = 0, rests = 0, within = 0;
    for (int seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        RefinedCourse course(seed, 0.005);
        for (int hand = 0; hand < 12; ++hand) course.push();
        const int fine = course.tube.chain.segments();
        course.keep(tolerance);
        for (int time = 0; time < 4; ++time) {
            const int segments = course.tube.chain.segments(), put_in = course.split - course.merged;
            course.refine();
            EXPECT_EQ(course.tube.chain.segments(), segments + course.split - course.merged - put_in);
            ASSERT_TRUE(course.tube.at_rest);
            ASSERT_TRUE(course.last.tip);
            EXPECT_LE(*course.last.tip, tolerance);
            EXPECT_TRUE(validate(course.tube.chain).empty());
            const double error = true_error(course);
            EXPECT_LE(error, 2 * tolerance) << "time " << time;
            ++rests;
            within += error <= tolerance;
        }
        merged += fine - course.tube.chain.segments();
        // Of all that was merged at once.
        Chain whole = course.tube.chain;
        for (int j = whole.segments() - 1; j >= 1; --j)
            if (whole.within_a_segment(j)) merge_segments(whole, j);
        GlobalRelaxer({}, *course.tube.wall).relax(whole, {1'000'000'000, 0, 0});
        costly += (finest(whole, *course.tube.wall).tip() - whole.tip()).norm() > tolerance;
    }
    EXPECT_GE(within, 0.9 * rests) << within << " of " << rests;
    EXPECT_GT(merged, 60);
    EXPECT_GE(costly, 4) << "whole segments are as good: this tests nothing";
}

TEST(ErrorRefinement, LeavesAChainWithinTheToleranceAsItIs) {
    const RandomTube tube(2);
    Chain chain = tube.chain;
    ErrorRefinement refinement(*tube.wall, {.tolerance = 10});
    const ErrorRefinementRound made = refinement.round(chain, all_contacts(chain, *tube.wall));
    ASSERT_TRUE(made.tip);
    EXPECT_FALSE(made.changed());
    EXPECT_GT(made.updates, chain.segments());
    EXPECT_EQ(chain.joints, tube.chain.joints);
}

TEST(ErrorRefinement, RemembersNothingOfOtherChains) {
    RefinedCourse one(1, 0.01), other(1, 0.01);
    for (int hand = 0; hand < 10; ++hand) {
        one.push();
        other.push();
        // Another chain in between, and another tolerance's rounds on a copy.
        Chain copy = other.tube.chain;
        ErrorRefinement(*other.tube.wall, {.tolerance = 1e-4})
            .round(copy, all_contacts(copy, *other.tube.wall));
        other.refinement->round(copy, all_contacts(copy, *other.tube.wall));
    }
    EXPECT_EQ(one.tube.chain.lengths, other.tube.chain.lengths);
    EXPECT_EQ(one.tube.chain.joints, other.tube.chain.joints);
    EXPECT_GT(one.split, 0);
}

TEST(ErrorRefinement, PiecesOfATipGoWithIt) {
    RandomTube tube(1, {.tip_segments = 1, .pushed = false});
    Chain& chain = tube.chain;
    for (int k = 0; k < 4; ++k) split_segment(chain, chain.segments());
    const std::vector<double> tip(chain.lengths.end() - 5, chain.lengths.end());
    EXPECT_NEAR(std::accumulate(tip.begin(), tip.end(), 0.0), tube.lambda, 1e-9);
    ASSERT_TRUE(tube.hub->settle(chain, 1'000'000'000).relax.at_rest());
    const int before = chain.segments();
    for (int k = 0; k < 6; ++k) {
        tube.push_all(0.7 * tube.lambda);
        ASSERT_TRUE(tube.at_rest);
        EXPECT_EQ(std::vector<double>(chain.lengths.end() - 5, chain.lengths.end()), tip) << "push " << k;
    }
    EXPECT_GE(chain.segments(), before + 3);
    // And all but the pieces lie λ apart.
    const std::vector<bool> within = chain.within_segments();
    int pieces = 0;
    for (int j = 0; j <= chain.segments(); ++j) {
        EXPECT_EQ(within[j], chain.within_a_segment(j)) << "joint " << j;
        pieces += within[j];
    }
    EXPECT_EQ(pieces, 4);
}
