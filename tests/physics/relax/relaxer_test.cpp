#include "physics/relax/relaxer.h"

#include <gtest/gtest.h>

namespace physics {

TEST(RelaxReport, AddsTheWorkAndKeepsTheLaterState) {
    RelaxReport sum, later;
    sum.updates = 10, sum.contacts = 4, sum.wall_queries = 7, sum.largest_turn = 0.3;
    sum.converged = true;
    later.updates = 5, later.contacts = 2, later.wall_queries = 1, later.largest_turn = 0.1, later.window = 9;
    later.at_rest = true;
    sum.add(later);
    EXPECT_EQ(sum.updates, 15);
    EXPECT_EQ(sum.wall_queries, 8);
    EXPECT_EQ(sum.contacts, 2);
    EXPECT_EQ(sum.largest_turn, 0.3);
    EXPECT_EQ(sum.window, 9);
    EXPECT_FALSE(sum.converged);
    EXPECT_TRUE(sum.at_rest);
}

}  // namespace physics
