/// The quick course of cost against accuracy.

#include "engine/studies/pareto.h"

#include <gtest/gtest.h>

using engine::StudyResult;
using engine::Table;

TEST(ParetoStudy, QuickRunFindsAFrontThatFallsAndAMethodForATenthOfAMillimetre) {
    engine::StudyOptions options;
    options.quick = true;
    options.threads = 2;
    const StudyResult result = engine::run_pareto(options);
    const Table& front = result.tables.at(1);
    ASSERT_GE(front.rows.size(), 3u);
    for (std::size_t r = 1; r < front.rows.size(); ++r)
        EXPECT_LT(std::get<double>(front.rows[r][3]), std::get<double>(front.rows[r - 1][3]));
    const Table& best = result.tables.at(2);
    EXPECT_NE(std::get<std::string>(best.rows.at(1).at(2)), "none");
}
