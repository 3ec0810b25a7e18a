/// A balloon's law: its maker's table, and what follows from it.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/scenario/device.h"
#include "physics/wall/opening.h"
#include "tests/engine/fixtures.h"

namespace physics {
namespace {

struct NamedLaw {
    std::string name;
    BalloonLaw law;
};

/// Of the catalogue, and one whose table begins below the pressure at which others unfold.
std::vector<NamedLaw> laws() {
    std::vector<NamedLaw> all = {{"made up", {1, {{0.5, 4}, {2, 5}, {9, 6}}}}};
    for (const std::filesystem::path& file : scenario::device_files(test::asset("devices")))
        if (const scenario::Device d = scenario::load_device(file); d.balloon)
            all.push_back({d.name, d.balloon->law});
    EXPECT_GE(all.size(), 8u);
    return all;
}

TEST(BalloonLaw, ItGivesEachRowOfItsTableExactly) {
    for (const auto& [name, law] : laws()) {
        for (const BalloonLaw::Row& row : law.table) {
            EXPECT_EQ(law.diameter(row.pressure), row.diameter) << name;
            EXPECT_EQ(law.wall_pressure(row.diameter), row.pressure) << name;
        }
        for (const double folded : {-1.0, 0.0}) EXPECT_EQ(law.diameter(folded), law.profile) << name;
        EXPECT_EQ(law.wall_pressure(law.profile), 0) << name;
        EXPECT_EQ(law.wall_pressure(0), 0) << name;
    }
}

TEST(BalloonLaw, BelowUnfoldingItIsALineFromTheFoldedProfileAndElseTheTablesLines) {
    const BalloonLaw law{1, {{4, 5}, {8, 6}, {12, 6.5}}};
    EXPECT_NEAR(law.diameter(1), 4.25, 1e-12);
    EXPECT_NEAR(law.diameter(0.5), 0.5 * (1 + 4.25), 1e-12);
    EXPECT_NEAR(law.diameter(6), 5.5, 1e-12);
    EXPECT_NEAR(law.diameter(20), 7.5, 1e-12);
    const BalloonLaw early{1, {{0.5, 4}, {2, 5}, {9, 6}}};
    EXPECT_NEAR(early.diameter(0.25), 2.5, 1e-12);
    EXPECT_NEAR(early.diameter(1), 4 + 1.0 / 3, 1e-12);
}

TEST(BalloonLaw, DiameterAndWallPressureAreEachOthersInversesAndRise) {
    const std::uint32_t seed = std::random_device{}();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    for (const auto& [name, law] : laws()) {
        const double most = 1.5 * law.table.back().pressure;
        std::uniform_real_distribution<double> pressure(0, most);
        std::vector<double> pressures = {1e-9, BalloonLaw::unfolds_at, most};
        for (int k = 0; k < 1000; ++k) pressures.push_back(pressure(random));
        std::ranges::sort(pressures);
        double below = law.profile;
        for (const double p : pressures) {
            const double d = law.diameter(p);
            EXPECT_GE(d, below) << name << ", " << p << " atm";
            EXPECT_NEAR(law.wall_pressure(d), p, 1e-9 * most) << name;
            below = d;
        }
    }
}

}  // namespace
}  // namespace physics
