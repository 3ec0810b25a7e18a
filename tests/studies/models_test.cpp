/// The quick study of what simplifications cost, and the energy of a hand over changes of a shaft's model.

#include <cmath>
#include <fstream>
#include <gtest/gtest.h>

#include "engine/studies/hands_course.h"
#include "engine/studies/runs.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"
#include "tests/studies/quick_study.h"

namespace {

studies::StudyOptions with_assets() {
    studies::StudyOptions options = test::quick_study();
    options.scenarios = test::asset("scenarios");
    options.devices = test::asset("devices");
    options.cache = test::cache();
    return options;
}

TEST(ModelsStudy, QuickRunMeasuresEveryModelAgainstTheFullOne) {
    const studies::StudyResult result = studies::run_models(with_assets());
    const io::Table& all = test::table_of(result, "models");
    ASSERT_EQ(all.rows.size(), 18u) << "two exercises, nine models";
    for (std::size_t row = 0; row < all.rows.size(); ++row) {
        EXPECT_GT(all.number(row, "ms_per_frame"), 0);
        EXPECT_LE(all.number(row, "rms_mm"), all.number(row, "largest_mm") * (1 + 1e-12));
        if (all.number(row, "model_number") == 0) {
            EXPECT_EQ(all.number(row, "largest_mm"), 0) << "against itself";
        }
        EXPECT_LT(all.number(row, "largest_mm"), 20) << "row " << row;
    }
    EXPECT_EQ(test::table_of(result, "models_stated").rows.size(), 2u);
    EXPECT_EQ(result.claims.size(), 3u);
}

struct ModelsEnergy : test::InFolder {};

/// Work of the hand against what is stored, lost by friction, and released by the changes themselves.
TEST_F(ModelsEnergy, IsBalancedOverChangesOfTheShaftsModel) {
    std::string text = test::small_toml;
    text = test::replaced(text, "path = [{run_mm = 30.0}, {arc_radius_mm = 25.0, angle_deg = 40.0}",
                          "path = [{run_mm = 150.0}, {arc_radius_mm = 25.0, angle_deg = 100.0}");
    text = test::replaced(text, "inserted_mm = 20.0", "inserted_mm = 90.0");
    text = test::replaced(text, "frictionless = true", "friction = 0.2");
    text = test::replaced(text, "torsion = \"rigid\"", "torsion = \"auto\"");
    std::ofstream(folder.path() / "bent.toml") << text;
    studies::HandCourse course(with_assets(), {(folder.path() / "bent").string()});
    course.feed(40);
    course.turn(1);
    course.feed(40);
    course.turn(-2);
    EXPECT_GE(course.simulation().model_changes().count, 2);
    EXPECT_LT(course.balance().error(), 0.01);
    EXPECT_LT(std::abs(course.simulation().model_changes().released),
              0.05 * std::abs(course.balance().exchanged));
}

}  // namespace
