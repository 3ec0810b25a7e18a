/// The quick study of how exact a wire of segments is: second order with half cells, first by the paper's
/// clamp.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "engine/studies/runs.h"
#include "tests/studies/quick_study.h"

namespace {

using io::Table;
using studies::StudyResult;

const StudyResult& result() {
    static const StudyResult once = studies::run_accuracy(test::quick_study(2));
    return once;
}

/// The number of a row that begins with these words.
double number(const Table& table, const std::vector<std::string>& words, const std::string& name) {
    for (const auto& row : table.rows) {
        bool same = true;
        for (std::size_t k = 0; k < words.size(); ++k)
            same = same && std::get<std::string>(row[k]) == words[k];
        if (same) return std::get<double>(row[table.column(name)]);
    }
    ADD_FAILURE() << words.front() << ": no such row";
    return std::nan("");
}

double order(const std::string& id, const std::string& quantity, const std::string& clamp) {
    return number(result().tables.at(1), {id, quantity, clamp}, "order");
}

}  // namespace

TEST(AccuracyStudy, HalfCellsAreOfSecondOrderAndThePapersClampOfFirst) {
    for (const char* id : {"wall", "bent tube", "small load", "large load", "opposed rods", "aligned rods",
                           "crossed rods", "wire ahead"})
        for (const char* quantity : {"tip", "farthest joint", "energy"}) {
            EXPECT_NEAR(order(id, quantity, "half"), 2, 0.05) << id << ", " << quantity;
            EXPECT_NEAR(order(id, quantity, "paper"), 1, 0.05) << id << ", " << quantity;
        }
    for (const char* id : {"wall", "bent tube"}) {
        EXPECT_NEAR(order(id, "force", "half"), 2, 0.05) << id;
        EXPECT_NEAR(order(id, "force", "paper"), 1, 0.05) << id;
    }
}

TEST(AccuracyStudy, FarFromTheEndsBothRulesAreOfSecondOrder) {
    for (const char* clamp : {"half", "paper"}) {
        EXPECT_NEAR(order("helix", "axial force", clamp), 2, 0.05);
        EXPECT_NEAR(order("helix", "wall force", clamp), 2, 0.05);
        EXPECT_NEAR(order("arc", "moment", clamp), 2, 0.1);
    }
}

TEST(AccuracyStudy, EveryWireIsAtRestAndATipAloneMeetsItsWall) {
    const Table& errors = result().tables.at(0);
    for (const auto& row : errors.rows) {
        const std::string& id = std::get<std::string>(row[0]);
        EXPECT_LT(std::get<double>(row[errors.column("gradient")]), 1e-9) << id;
        const double contacts = std::get<double>(row[errors.column("contacts")]);
        if (id == "wall" || id == "bent tube") {
            EXPECT_EQ(contacts, 1) << id;
        }
        if (id == "small load" || id == "large load" || id.ends_with("rods") || id == "wire ahead") {
            EXPECT_EQ(contacts, 0) << id;
        }
        if (id == "helix") {
            EXPECT_GT(contacts, 40);
        }
    }
}

TEST(AccuracyStudy, ForceOnAWallAndTipUnderLoadAreAsTheClaimsHaveThem) {
    const Table& orders = result().tables.at(1);
    EXPECT_NEAR(100 * number(orders, {"wall", "force", "half"}, "error_at_1_mm"), 0.118, 0.002);
    EXPECT_NEAR(100 * number(orders, {"wall", "force", "paper"}, "error_at_1_mm"), 6.80, 0.03);
    EXPECT_FALSE(result().claims.empty());
    for (const studies::Claim& claim : result().claims) EXPECT_TRUE(claim.holds) << claim.text;
    EXPECT_NEAR(std::get<double>(result().claims.back().measured), 1.31e-5, 0.02e-5);
}

TEST(AccuracyStudy, TheRaceHasEveryMethodAndThePictureReadsIt) {
    const Table& race = result().tables.at(2);
    EXPECT_EQ(race.rows.size(), 18u);
    EXPECT_LT(number(race, {"global (half cells)", "half"}, "farthest_joint_mm"), 0.03);  // λ = 4 mm
    ASSERT_EQ(result().plots.size(), 1u);
    for (const auto& row : race.rows) {
        EXPECT_NE(result().plots[0].commands.find(std::get<std::string>(row[0])), std::string::npos);
        EXPECT_GT(std::get<double>(row[race.column("cpu_s")]), 0);
    }
}
