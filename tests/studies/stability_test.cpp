/// The quick map: whole, the same on any number of threads, and with the outcomes that no change should lose.

#include <algorithm>
#include <gtest/gtest.h>
#include <map>

#include "engine/studies/runs.h"
#include "tests/anatomies.h"
#include "tests/studies/quick_study.h"

namespace {

using io::Table;
using studies::StudyResult;

StudyResult quick_map(int threads) {
    studies::StudyOptions options = test::quick_study(threads);
    options.cache = test::cache();
    return studies::run_stability(options);
}

}  // namespace

TEST(Stability, QuickMapIsWholeAndIndependentOfThreads) {
    const StudyResult one = quick_map(1), two = quick_map(2);
    const Table& a = one.tables.at(0);
    const Table& b = two.tables.at(0);
    ASSERT_EQ(a.rows.size(), 13u * 6u);
    ASSERT_EQ(b.rows.size(), a.rows.size());
    for (std::size_t r = 0; r < a.rows.size(); ++r) {
        EXPECT_EQ(a.rows[r].size(), a.columns.size());
        for (const char* name :
             {"case", "method", "outcome", "energy_N_mm", "deviation_mm", "gradient", "updates"}) {
            const std::size_t k = a.column(name);
            EXPECT_EQ(a.rows[r][k], b.rows[r][k]) << r << " " << name;
        }
    }
    EXPECT_NE(one.page.find("## Rules"), std::string::npos);

    std::map<std::string, int> outcomes;
    std::map<std::string, int> lost;  // NaN or out of the lumen, by method
    for (const auto& row : a.rows) {
        const std::string outcome = std::get<std::string>(row[a.column("outcome")]);
        ++outcomes[outcome];
        if (std::get<std::string>(row[a.column("method")]) == "global") {
            EXPECT_EQ(outcome, "converged") << std::get<std::string>(row[a.column("case")]);
        }
        if (outcome == "NaN" || outcome == "left the lumen" || outcome == "oscillates")
            ++lost[std::get<std::string>(row[a.column("method")])];
    }
    for (const auto& [outcome, count] : outcomes) {
        std::string name = outcome;
        std::replace(name.begin(), name.end(), ' ', '_');
        RecordProperty(name, count);
    }
    EXPECT_GE(outcomes["converged"], 30);
    // The safeguard never raises the energy and never loses the wire.
    EXPECT_EQ(lost["M = 2 safe"], 0);
}
