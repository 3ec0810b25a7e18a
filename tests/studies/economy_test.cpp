/// The quick study of what chosen and adaptive segments save.

#include "engine/studies/economy.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using engine::StudyResult;
using engine::Table;

TEST(EconomyStudy, QuickRunSavesSegmentsAndStaysNearTheReference) {
    engine::StudyOptions options;
    options.quick = true;
    const StudyResult result = engine::run_economy(options);
    const Table& all = result.tables.at(0);
    const auto number = [&](std::size_t row, const char* column) {
        const auto at = std::find(all.columns.begin(), all.columns.end(), column) - all.columns.begin();
        return std::get<double>(all.rows.at(row).at(at));
    };
    ASSERT_EQ(all.rows.size(), 4u);
    EXPECT_LT(number(0, "largest_deviation_mm"), 1e-12);
    EXPECT_LT(number(1, "segments"), 0.8 * number(0, "segments"));
    EXPECT_LT(number(1, "median_deviation_mm"), 0.05);
    EXPECT_LE(number(3, "segments"), number(2, "segments"));
    for (std::size_t row = 0; row < 4; ++row) EXPECT_EQ(number(row, "unconverged"), 0.0);
    EXPECT_NE(result.page.find("narrows to a radius of 1.5 mm"), std::string::npos);
}
