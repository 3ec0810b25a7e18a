/// Inside, outside and crossings on generated vessels, as the study anatomy tells of them.

#include "engine/studies/anatomy_sign.h"

#include <algorithm>
#include <gtest/gtest.h>

#include "tests/anatomies.h"

namespace {

using engine::Table;

Table signs(const char* preset) {
    engine::StudyOptions options;
    options.quick = true;
    options.cache = engine::test::cache();
    Table table = engine::sign_table();
    engine::add_signs(table, preset, options);
    std::printf("%s\n", engine::to_markdown(table).c_str());
    return table;
}

double number(const Table& table, const std::vector<engine::TableCell>& row, const char* column) {
    const auto at = std::find(table.columns.begin(), table.columns.end(), column);
    return std::get<double>(row.at(static_cast<std::size_t>(at - table.columns.begin())));
}

void expect_signs(const char* preset) {
    const Table table = signs(preset);
    ASSERT_EQ(table.rows.size(), 6u);
    for (const auto& row : table.rows) {
        const std::string what = std::get<std::string>(row[1]) + ", " + std::get<std::string>(row[3]);
        EXPECT_EQ(std::get<std::string>(row[2]),
                  row == table.rows[0] || row == table.rows[1] ? "accepts" : "refuses")
            << what;
        EXPECT_LE(number(table, row, "wrong_anywhere_percent"), 0.1) << what;
        EXPECT_LE(number(table, row, "wrong_at_carinas_percent"), 0.1) << what;
        EXPECT_GT(number(table, row, "places_at_carinas"), 1000) << what;
        EXPECT_EQ(number(table, row, "contacts_past_ends"), 0) << what;
        EXPECT_GT(number(table, row, "crossings"), 20) << what;
        EXPECT_EQ(number(table, row, "missed_crossings"), 0) << what;
    }
}

}  // namespace

TEST(AnatomySign, OfAnAorticArchIsRightAndCrossingsAreFound) {
    expect_signs("arch-1");
}

TEST(AnatomySign, OfTheLeftCoronaryArteryIsRightAndCrossingsAreFound) {
    expect_signs("lca");
}
