#include <gtest/gtest.h>
#include <limits>

#include "engine/io/csv.h"

namespace io {

TEST(Table, CsvQuotesWordsAndKeepsNumbersWhole) {
    Table table{"t", {"name", "energy_N_mm"}, {}};
    table.add({std::string("a, \"b\""), 0.1});
    table.add({std::string("c"), std::numeric_limits<double>::quiet_NaN()});
    EXPECT_EQ(to_csv(table), "name,energy_N_mm\n\"a, \"\"b\"\"\",0.1\nc,\n");
}

TEST(Table, MarkdownRoundsNumbersAndPutsThemRight) {
    Table table{"t", {"name", "x"}, {}};
    table.add({std::string("a|b\nc"), 1.0 / 3});
    EXPECT_EQ(to_markdown(table, 3), "| name | x |\n| --- | ---: |\n| a\\|b<br>c | 0.333 |\n");
}

}  // namespace io
