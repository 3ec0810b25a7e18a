/// The quick study of what chosen and adaptive segments save.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "engine/studies/runs.h"
#include "tests/studies/quick_study.h"

using io::Table;
using studies::StudyResult;

TEST(EconomyStudy, QuickRunSavesSegmentsAndStaysNearTheReference) {
    const StudyResult result = studies::run_economy(test::quick_study());
    const Table& all = result.tables.at(0);
    ASSERT_EQ(all.rows.size(), 4u);
    EXPECT_LT(all.number(0, "largest_deviation_mm"), 1e-12);
    EXPECT_LT(all.number(1, "segments"), 0.8 * all.number(0, "segments"));
    EXPECT_LT(all.number(1, "median_deviation_mm"), 0.05);
    EXPECT_LE(all.number(3, "segments"), all.number(2, "segments"));
    for (std::size_t row = 0; row < 4; ++row) EXPECT_EQ(all.number(row, "unconverged"), 0.0);
    EXPECT_NE(result.page.find("narrows to a radius of 1.5 mm"), std::string::npos);
}
