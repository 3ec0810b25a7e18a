#include <gtest/gtest.h>

#include "engine/studies/pareto_measure.h"

namespace studies {

TEST(Pareto, FrontKeepsWhatNothingBeatsInBoth) {
    const std::vector<CostPoint> points = {{0, 1, 5}, {0, 2, 3}, {1, 1.5, 3},
                                           {1, 3, 4}, {1, 4, 1}, {2, 4, 1}};
    EXPECT_EQ(pareto_front(points), (std::vector<int>{0, 2, 4}));
    EXPECT_TRUE(pareto_front({}).empty());
}

TEST(Pareto, AMethodIsThereOnceItStaysThere) {
    const std::vector<CostPoint> points = {{0, 1, 0.05}, {0, 2, 0.5}, {0, 3, 0.08}, {0, 4, 0.01}};
    EXPECT_EQ(settled_at(points, 0.1), 2);
    EXPECT_EQ(settled_at(points, 1), 0);
    EXPECT_EQ(settled_at(points, 0.001), -1);
}

}  // namespace studies
