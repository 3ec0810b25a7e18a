/// The quick course of cost against accuracy.

#include "engine/studies/pareto.h"

#include <gtest/gtest.h>

using io::Table;
using studies::StudyResult;

TEST(ParetoStudy, QuickRunFindsAFrontThatFallsAndAMethodForATenthOfAMillimetre) {
    studies::StudyOptions options;
    options.quick = true;
    options.threads = 2;
    const StudyResult result = studies::run_pareto(options);
    const Table& front = result.tables.at(1);
    ASSERT_GE(front.rows.size(), 3u);
    for (std::size_t r = 1; r < front.rows.size(); ++r)
        EXPECT_LT(std::get<double>(front.rows[r][3]), std::get<double>(front.rows[r - 1][3]));
    const Table& best = result.tables.at(2);
    EXPECT_NE(std::get<std::string>(best.rows.at(1).at(2)), "none");
}
