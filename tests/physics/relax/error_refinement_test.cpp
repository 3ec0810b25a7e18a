#include "physics/relax/error_refinement.h"

#include <gtest/gtest.h>

#include "tests/physics/random_tube.h"

using namespace physics;

TEST(ErrorRefinement, BringsTipsNearerWithFewerSegmentsThanUniformOnesNeed) {
    int refined = 0, nearer = 0;
    double segments = 0, of_uniform = 0;
    for (int seed = 0; seed < 30; ++seed) {
        const RandomTube tube(seed);
        const auto before = ErrorEstimator(*tube.wall).of(tube.chain, tube.hub->contacts());
        ASSERT_TRUE(before);
        Chain chain = tube.chain;
        GlobalRelaxer relaxer({}, *tube.wall);
        relaxer.relax(chain, {1'000'000, 0, 0});
        const ErrorRefinement made =
            refine_to_error(chain, *tube.wall, relaxer, {.tolerance = 0.4 * before->tip});
        ASSERT_TRUE(made.at_rest) << "seed " << seed;
        EXPECT_TRUE(validate(chain).empty());
        EXPECT_EQ(chain.segments(), tube.chain.segments() + made.split);
        EXPECT_NEAR(chain.inserted_length(), tube.chain.inserted_length(), 1e-9);
        if (before->tip < 1e-3) continue;
        const Vec3 truth = halved(tube.chain, *tube.wall, 4).tip();
        ++refined;
        const double error = (chain.tip() - truth).norm();
        nearer += error < 0.8 * (tube.chain.tip() - truth).norm();
        int halvings = 1;
        while (halvings < 4 && (halved(tube.chain, *tube.wall, halvings).tip() - truth).norm() > error)
            ++halvings;
        segments += chain.segments();
        of_uniform += tube.chain.segments() << halvings;
    }
    EXPECT_GE(refined, 20);
    EXPECT_GE(nearer, 0.8 * refined) << nearer << " of " << refined;
    EXPECT_LE(1.5 * segments, of_uniform) << segments << " segments against " << of_uniform;
    RecordProperty("fewer", std::to_string(of_uniform / segments));
}

TEST(ErrorRefinement, LeavesAChainWithinTheToleranceAsItIs) {
    const RandomTube tube(2);
    Chain chain = tube.chain;
    GlobalRelaxer relaxer({}, *tube.wall);
    relaxer.relax(chain, {1'000'000, 0, 0});
    const std::vector<Vec3> joints = chain.joints;
    const ErrorRefinement made = refine_to_error(chain, *tube.wall, relaxer, {.tolerance = 10});
    EXPECT_EQ(made.split, 0);
    EXPECT_EQ(made.rounds, 0);
    EXPECT_EQ(chain.joints, joints);
}
