#include "engine/scenario/motion_field.h"

#include <gtest/gtest.h>
#include <random>

#include "engine/blood/contrast_flow.h"
#include "engine/scenario/placement.h"
#include "tests/engine/fixtures.h"

namespace scenario {
namespace {

using geometry::Vec3;

struct Vessels {
    Scenario scenario;
    anatomy::Anatomy anatomy;
    blood::BloodFlow blood;
    explicit Vessels(const char* exercise)
        : scenario(test::shipped_scenario(exercise)),
          anatomy(anatomy_of(scenario)),
          blood(blood::blood_flow(anatomy, scenario.blood)) {}
};

// Of the coronary arteries' displacement at the end of systole, 20 to 40 % differ from its mean.
TEST(MotionField, OfAHeartIsAFifthToTwoFifthsNotRigid) {
    for (const char* exercise : {"coronary_lad", "coronary_right"}) {
        const Vessels v(exercise);
        const MotionField field(v.scenario.motion, v.blood);
        ASSERT_FALSE(field.rigid());
        Vec3 sum = Vec3::Zero();
        double square = 0;
        for (const blood::FlowCell& cell : v.blood.cells) {
            sum += field.systole_at(cell.centre);
            square += field.systole_at(cell.centre).squaredNorm();
        }
        const auto count = static_cast<double>(v.blood.cells.size());
        const double rigid = (sum / count).squaredNorm(), whole = square / count;
        const double fraction = std::sqrt((whole - rigid) / whole);
        RecordProperty(std::string(exercise) + "_fraction", std::to_string(fraction));
        EXPECT_GT(fraction, 0.2) << exercise;
        EXPECT_LT(fraction, 0.4) << exercise;
    }
}

// A catheter is held by the arch: what is away from the heart hardly beats, and breathes by a third.
TEST(MotionField, FadesAlongTheAorta) {
    const Vessels v("coronary_jl4");
    const MotionField field(v.scenario.motion, v.blood);
    const auto end = *anatomy::find_end(v.anatomy, "aorta.out");
    const Vec3 descending = v.anatomy.ends[static_cast<std::size_t>(end)].opening.centre;
    const Vec3 mouth = target_of(v.scenario, v.anatomy);
    EXPECT_GT(field.systole_at(mouth).norm(), 0.6 * v.scenario.motion.heart_reach.norm());
    EXPECT_LT(field.systole_at(descending).norm(), 0.25 * v.scenario.motion.heart_reach.norm());
    EXPECT_LT(field.at(descending, 0, 1).norm(), 0.5 * v.scenario.motion.breathing_reach.norm());
    EXPECT_EQ(field.at(mouth, 0, 0), Vec3::Zero());
}

TEST(MotionField, IsSmoothEverywhere) {
    const Vessels v("coronary_lad");
    const MotionField field(v.scenario.motion, v.blood);
    std::mt19937 random(7);
    const auto number = [&] { return 600 * std::ldexp(static_cast<double>(random()), -32) - 300; };
    for (int k = 0; k < 20000; ++k) {
        const Vec3 x(number(), number(), number()), step = Vec3(number(), number(), number()).normalized();
        const Vec3 here = field.at(x, 1, 1), there = field.at(x + step, 1, 1);
        ASSERT_TRUE(here.allFinite());
        ASSERT_LT((here - there).norm(), 0.5) << x.transpose();  // of a millimetre: nothing folds
    }
}

TEST(MotionField, OfVesselsWithoutAHeartIsRigid) {
    Vessels v("renal");
    v.scenario.motion.heart_reach = Vec3(1, 2, 3);
    v.scenario.motion.breathing_reach = Vec3(0, 0, -9);
    const MotionField field(v.scenario.motion, v.blood);
    EXPECT_TRUE(field.rigid());
    EXPECT_EQ(field.at(Vec3(5, 6, 7), 0.5, 1), Vec3(0.5, 1, -7.5));
}

}  // namespace
}  // namespace scenario
