/// Inside, outside and crossings on generated vessels, as the study anatomy measures them.

#include "engine/studies/anatomy_sign.h"

#include <algorithm>
#include <gtest/gtest.h>

#include "tests/anatomies.h"
#include "tests/studies/quick_study.h"

namespace {

using io::Table;

io::Table signs(const char* preset) {
    studies::StudyOptions options = test::quick_study();
    options.cache = test::cache();
    Table table = studies::sign_table();
    studies::add_signs(table, preset, options);
    return table;
}

void expect_signs(const char* preset) {
    const Table table = signs(preset);
    ASSERT_EQ(table.rows.size(), 6u);
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        const auto& row = table.rows[r];
        const std::string what = std::get<std::string>(row[1]) + ", " + std::get<std::string>(row[3]);
        EXPECT_EQ(std::get<std::string>(row[2]),
                  row == table.rows[0] || row == table.rows[1] ? "accepts" : "refuses")
            << what;
        EXPECT_LE(table.number(r, "wrong_anywhere_percent"), 0.1) << what;
        EXPECT_LE(table.number(r, "wrong_at_carinas_percent"), 0.1) << what;
        EXPECT_GT(table.number(r, "places_at_carinas"), 1000) << what;
        EXPECT_EQ(table.number(r, "contacts_past_ends"), 0) << what;
        EXPECT_GT(table.number(r, "crossings"), 20) << what;
        EXPECT_EQ(table.number(r, "missed_crossings"), 0) << what;
    }
}

}  // namespace

TEST(AnatomySign, OfAnAorticArchIsRightAndCrossingsAreFound) {
    expect_signs("arch-1");
}

TEST(AnatomySign, OfTheLeftCoronaryArteryIsRightAndCrossingsAreFound) {
    expect_signs("lca");
}
