#include "physics/relax/discretisation_error.h"

#include <gtest/gtest.h>
#include <numeric>

#include "tests/physics/random_tube.h"
#include "tests/physics/wires.h"

using namespace physics;

TEST(DiscretisationError, OfRandomTubesIsTheDistanceFromFarShorterSegments) {
    RatioCounts tips, forces;
    for (int seed = 0; seed < 60; ++seed) {
        const RandomTube tube(seed);
        ASSERT_TRUE(tube.at_rest) << "seed " << seed;
        const ErrorRatio ratio = error_ratio(tube);
        tips.add(ratio.of_tip());
        forces.add(ratio.of_force());
        EXPECT_LE(ratio.of_tip(), 4) << "seed " << seed << ": " << ratio.true_tip << " mm, estimate "
                                     << ratio.tip;
        EXPECT_LE(ratio.of_force(), 4)
            << "seed " << seed << ": " << ratio.true_force << " N, estimate " << ratio.force;
    }
    EXPECT_GE(tips.share(), 0.9) << tips.within_two << " of " << tips.cases;
    EXPECT_GE(forces.share(), 0.9) << forces.within_two << " of " << forces.cases;
    RecordProperty("largest", std::to_string(tips.largest));
}

TEST(DiscretisationError, OfALoadedCantileverIsSecondOrder) {
    // Half as long segments have a quarter of the error, and the estimate says so.
    double before = 0;
    for (const int segments : {20, 40, 80}) {
        Chain wire = uniform_wire(50, 60.0 / segments, Vec3::Zero(), Vec3::UnitX(),
                                  std::vector<Vec3>(segments, Vec3::UnitX()));
        wire.load = {0, 0, -2e-3};
        const TubeWall wall({{-10, 0, 0}, {200, 0, 0}}, 100, 1);
        global_relaxer(wall)->relax(wire, unlimited);
        const auto error = ErrorEstimator(wall).of(wire, all_contacts(wire, wall));
        ASSERT_TRUE(error);
        EXPECT_EQ(error->wall_force, 0);
        const Chain fine = halved(wire, wall, 3);
        EXPECT_NEAR(error->tip, (fine.tip() - wire.tip()).norm(), 0.1 * error->tip);
        EXPECT_GT(error->tip_moves.dot(fine.tip() - wire.tip()), 0.99 * error->tip * error->tip * 0.9);
        if (before > 0) {
            EXPECT_NEAR(before / error->tip, 4, 0.2);
        }
        before = error->tip;
    }
}

TEST(DiscretisationError, ChangesNothingAndDoesNotRememberTheLastChain) {
    const RandomTube one(3), other(4);
    const auto contacts = all_contacts(one.chain, *one.wall);
    const std::vector<Vec3> joints = one.chain.joints;
    ErrorEstimator estimator(*one.wall);
    const auto first = estimator.of(one.chain, contacts, true);
    Chain shorter = one.chain;
    GlobalRelaxer relaxer({}, *one.wall);
    feed(shorter, every_device, -3 * one.chain.grid.segment_length);
    relaxer.relax(shorter, unlimited);
    ASSERT_TRUE(estimator.of(shorter, all_contacts(shorter, *one.wall)));
    const auto again = estimator.of(one.chain, contacts, true);
    ASSERT_TRUE(first && again);
    EXPECT_EQ(first->tip_moves, again->tip_moves);
    EXPECT_EQ(first->wall_force, again->wall_force);
    EXPECT_EQ(first->segments, again->segments);
    EXPECT_EQ(one.chain.joints, joints);
}

TEST(DiscretisationError, ItsPartsAddUpAndNameTheSegmentsThatCauseIt) {
    int lower = 0, cases = 0;
    for (int seed = 0; seed < 20; ++seed) {
        const RandomTube tube(seed);
        const auto error =
            ErrorEstimator(*tube.wall).of(tube.chain, all_contacts(tube.chain, *tube.wall), true);
        ASSERT_TRUE(error);
        const std::vector<double>& parts = error->segments;
        ASSERT_EQ(parts.size(), tube.chain.joints.size());
        if (error->tip < 1e-3) continue;
        EXPECT_NEAR(std::accumulate(parts.begin(), parts.end(), 0.0), error->tip, 1e-9) << "seed " << seed;
        // The chain with its worst quarter in halves, twice over, is nearer to the truth than that with the
        // least.
        const Vec3 truth = halved(tube.chain, *tube.wall, 4).tip();
        std::vector<int> order(tube.chain.segments());
        std::iota(order.begin(), order.end(), 1);
        std::ranges::sort(order, std::greater(), [&](int i) { return std::abs(parts[i]); });
        const auto with = [&](std::vector<int> which) {
            std::ranges::sort(which, std::greater());
            Chain chain = tube.chain;
            for (const int i : which) {
                split_segment(chain, i);
                split_segment(chain, i + 1);
                split_segment(chain, i);
            }
            GlobalRelaxer({}, *tube.wall).relax(chain, unlimited);
            return (chain.tip() - truth).norm();
        };
        const std::size_t quarter = order.size() / 4;
        ++cases;
        lower += with({order.begin(), order.begin() + quarter}) < with({order.end() - quarter, order.end()});
    }
    EXPECT_GE(cases, 12);
    EXPECT_GE(lower, 0.85 * cases) << lower << " of " << cases;
}

TEST(DiscretisationError, IsEmptyWhereThereIsNone) {
    const TubeWall wall({{-10, 0, 0}, {200, 0, 0}}, 5, 1);
    ErrorEstimator estimator(wall);
    const Chain one = uniform_wire(50, 2, Vec3::Zero(), Vec3::UnitX(), {Vec3::UnitX()});
    EXPECT_FALSE(estimator.of(one, all_contacts(one, wall)));
    Chain wire = uniform_wire(50, 2, Vec3::Zero(), Vec3::UnitX(), std::vector<Vec3>(20, Vec3::UnitX()));
    // The contacts of another chain.
    EXPECT_FALSE(estimator.of(wire, all_contacts(one, wall)));
    // A column under far more than its critical load has no minimum near.
    wire.load = {-1, 0, 0};
    EXPECT_FALSE(estimator.of(wire, all_contacts(wire, wall)));
    wire.load.setZero();
    Chain lost = wire;
    lost.joints.back()[1] = std::nan("");
    EXPECT_FALSE(estimator.of(lost, all_contacts(wire, wall)));
    EXPECT_TRUE(estimator.of(wire, all_contacts(wire, wall)));
}
