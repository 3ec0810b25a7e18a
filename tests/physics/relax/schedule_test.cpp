#include "physics/relax/schedule.h"

#include <gtest/gtest.h>
#include <map>

using namespace physics;

TEST(CycleWalk, NestedCycleVisitsSegmentBAsOftenAsItsPlace) {
    CycleWalk walk(CycleOrder::Nested);
    std::map<int, int> visits;
    for (int k = 0; k < 200 * 201 / 2; ++k) ++visits[walk.next(1, 200)];
    long long joints = 0;
    for (const auto& [segment, count] : visits) {
        EXPECT_EQ(count, segment);
        joints += static_cast<long long>(count) * (200 - segment + 1);
    }
    EXPECT_EQ(joints, 1353400);  // wall evaluations of a cycle at N = 200
    EXPECT_EQ(walk.next(1, 200), 1);
}

TEST(CycleWalk, NestedSweepsStartOneSegmentLaterEachTime) {
    CycleWalk walk(CycleOrder::Nested);
    std::vector<int> order;
    for (int k = 0; k < 10; ++k) order.push_back(walk.next(1, 4));
    EXPECT_EQ(order, (std::vector<int>{1, 2, 3, 4, 2, 3, 4, 3, 4, 4}));
}

TEST(CycleWalk, UniformSweepsVisitAllAlike) {
    CycleWalk walk(CycleOrder::Uniform);
    std::map<int, int> visits;
    for (int k = 0; k < 35; ++k) ++visits[walk.next(3, 9)];
    ASSERT_EQ(visits.size(), 7u);
    for (const auto& [segment, count] : visits) EXPECT_EQ(count, 5);
}

TEST(CycleWalk, GoesOnWhenTheWireGrowsOrShrinks) {
    CycleWalk walk(CycleOrder::Nested);
    for (int k = 0; k < 1000; ++k) {
        const int last = 30 + (k * 7) % 40;
        const int segment = walk.next(1, last);
        EXPECT_GE(segment, 1);
        EXPECT_LE(segment, last);
    }
}

TEST(Schedule, GivesTheTipItsFractionOfTheBudget) {
    Schedule schedule(CycleOrder::Nested);
    const RelaxBudget budget{4000, 0.75, 20};
    // In the uniform walk over 200 segments few updates fall into the window by themselves.
    Schedule uniform(CycleOrder::Uniform);
    int distal = 0;
    for (int k = 0; k < 4000; ++k)
        if (uniform.next(200, budget).segment > 180) ++distal;
    EXPECT_NEAR(distal, 3000 + 100, 20);
}

TEST(Schedule, WithoutAShareIsTheWholeCycle) {
    Schedule schedule(CycleOrder::Nested);
    CycleWalk walk(CycleOrder::Nested);
    const RelaxBudget budget = whole_cycles(30, 2);
    EXPECT_EQ(budget.updates, 930);
    for (int k = 0; k < budget.updates; ++k) EXPECT_EQ(schedule.next(30, budget).segment, walk.next(1, 30));
}
