/// The quick study of friction and torsion: every closed form is met.

#include <gtest/gtest.h>

#include "engine/studies/runs.h"
#include "tests/studies/quick_study.h"

TEST(DevicesStudy, MeetsItsClosedForms) {
    const studies::StudyResult result = studies::run_devices(test::quick_study(2));
    EXPECT_EQ(result.claims.size(), 9u + 3 + 2 + 7 + 9 + 5 + 2 * 5 + 18);
    for (const studies::Claim& claim : result.claims)
        EXPECT_TRUE(claim.holds) << claim.text << ": "
                                 << (std::holds_alternative<double>(claim.measured)
                                         ? std::get<double>(claim.measured)
                                         : 0.0);
    for (const io::Table& table : result.tables) EXPECT_FALSE(table.rows.empty()) << table.name;
}
