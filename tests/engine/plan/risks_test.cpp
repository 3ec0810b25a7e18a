#include "engine/plan/risks.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "tests/engine/vessels.h"

namespace plan {
namespace {

const Risk* risk_of(const std::vector<Risk>& all, const std::string& kind) {
    const auto found = std::ranges::find(all, kind, &Risk::kind);
    return found == all.end() ? nullptr : &*found;
}

}  // namespace

TEST(PlanRisks, AngleThinBranchAndNarrowMouthAreFoundWhereTheyAre) {
    anatomy::Anatomy abdomen = test::small_abdomen();
    const geometry::Vec3 from(0, 0, 0), to(45, 0, 50);
    const std::vector<Risk> usual = risks(abdomen, from, to, 1);
    ASSERT_TRUE(risk_of(usual, "angle of take-off"));
    EXPECT_NEAR(risk_of(usual, "angle of take-off")->value, 90, 3);
    EXPECT_EQ(risk_of(usual, "angle of take-off")->branch, "LRA");
    EXPECT_FALSE(risk_of(usual, "thin branch"));
    EXPECT_FALSE(risk_of(usual, "ostial stenosis"));
    EXPECT_FALSE(risk_of(usual, "sharp bend"));
    EXPECT_FALSE(risk_of(usual, "aortic arch"));
    const std::vector<Risk> thick = risks(abdomen, from, to, 5.9);
    ASSERT_TRUE(risk_of(thick, "thin branch"));
    EXPECT_EQ(risk_of(thick, "thin branch")->branch, "LRA");
    EXPECT_NEAR(risk_of(thick, "thin branch")->value, 6, 1e-9);
    for (std::size_t k = 0; k < abdomen.branches[1].radii.size(); ++k)
        if (k <= 15) abdomen.branches[1].radii[k] = 1;
    const std::vector<Risk> narrow = risks(abdomen, from, to, 1);
    ASSERT_TRUE(risk_of(narrow, "ostial stenosis"));
    EXPECT_NEAR(risk_of(narrow, "ostial stenosis")->value, 67, 8);
}

/// A circle of 6 mm through a vessel of 4 mm; one of 40 mm is none.
TEST(PlanRisks, ASharpBendHasTheRadiusOfItsCircle) {
    for (const double bend : {6.0, 40.0}) {
        anatomy::Anatomy anatomy;
        geometry::CentrelineBranch branch;
        branch.name = "tube";
        for (int k = -40; k <= 0; ++k) branch.points.emplace_back(k, 0, 0);
        for (double angle = 0.02; angle < 1.57; angle += 0.02)
            branch.points.emplace_back(bend * std::sin(angle), bend * (1 - std::cos(angle)), 0);
        const geometry::Vec3 last = branch.points.back();
        for (int k = 1; k <= 40; ++k) branch.points.push_back(last + geometry::Vec3(0, k, 0));
        branch.radii.assign(branch.points.size(), 2.0);
        anatomy.branches = {branch};
        test::add_end(anatomy, "tube.in", branch.points.front(), {-1, 0, 0}, 2, anatomy::EndRole::Inlet);
        const std::vector<Risk> all = risks(anatomy, branch.points.front(), branch.points.back(), 1);
        const Risk* sharp = risk_of(all, "sharp bend");
        ASSERT_EQ(sharp != nullptr, bend == 6.0) << bend;
        if (sharp) {
            EXPECT_NEAR(sharp->value, bend, 0.8);
        }
    }
}

/// The presets are named by the type that their arch has.
TEST(PlanRisks, ArchesOfThePresetsAreOfTheirType) {
    for (const auto& [preset, type] : {std::pair("arch-1", "type I:"), std::pair("arch-2", "type II:"),
                                       std::pair("arch-3", "type III:")}) {
        const anatomy::Anatomy arch = test::grown(preset);
        const auto trunk = anatomy::branch_named(arch, "brachiocephalic");
        ASSERT_TRUE(trunk) << preset;
        const auto& aorta =
            arch.branches[static_cast<std::size_t>(arch.branches[static_cast<std::size_t>(*trunk)].parent)];
        const std::vector<Risk> all = risks(arch, aorta.points.back(),
                                            arch.branches[static_cast<std::size_t>(*trunk)].points.back(), 1);
        ASSERT_TRUE(risk_of(all, "aortic arch")) << preset;
        EXPECT_NE(risk_of(all, "aortic arch")->said.find(type), std::string::npos)
            << preset << ": " << risk_of(all, "aortic arch")->said;
    }
}

}  // namespace plan
