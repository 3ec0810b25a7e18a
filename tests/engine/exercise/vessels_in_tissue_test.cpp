/// A vessel that makes way, from the scenario's key to the image's truth.

#include <cmath>
#include <gtest/gtest.h>

#include "engine/anatomy/organs.h"
#include "engine/exercise/exercise.h"
#include "engine/io/error.h"
#include "engine/scenario/placement.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace {

using exercise::Exercise;

/// A Lunderquist wire up a bent iliac artery into the aorta; `tissue`: text of that section, or none.
Exercise pushed_up(const std::vector<scenario::Override>& tissue) {
    std::vector<scenario::Override> overrides = {{"guidewire.device", "\"lunderquist035\""},
                                                 {"c_arm.pixels", "256"}};
    overrides.insert(overrides.end(), tissue.begin(), tissue.end());
    Exercise exercise(test::shipped_scenario("iliac_aorta", overrides), true, test::cache());
    const auto next = [&](std::vector<script::Command> commands) {
        return exercise.next_frame(commands).motion;
    };
    next({script::Beam{true}});
    for (int frame = 0; frame < 100; ++frame) {
        const exercise::StepReport report = next({script::Advance{3}});
        EXPECT_TRUE(report.settling || report.relax.newton_steps == 0 || report.relax.at_rest());
    }
    for (int frame = 0; frame < 5; ++frame) next({});
    return exercise;
}

double largest_force(const Exercise& exercise) {
    return physics::largest_force(exercise.simulation().contacts());
}

}  // namespace

TEST(VesselsInTissue, MakeWayForAStiffWireAndTheTruthShowsThemWhereTheyAre) {
    Exercise rigid = pushed_up({{"tissue.rigid", "true"}}),
             soft = pushed_up({{"tissue.modulus_N_per_mm2", "0.01"}});
    EXPECT_EQ(rigid.simulation().farthest_vessel_move(), 0);
    EXPECT_TRUE(rigid.simulation().vessel_moves().of_nodes.empty());
    const double moved = soft.simulation().farthest_vessel_move();
    EXPECT_GT(moved, 0.5);
    EXPECT_LT(moved, 20);
    EXPECT_LT(largest_force(soft), largest_force(rigid));
    // The nodes of the contrast go with the vessel, and so does the mask of the truth.
    const auto moves = soft.simulation().vessel_moves();
    ASSERT_EQ(moves.of_nodes.size(), soft.simulation().contrast().nodes().size());
    float farthest = 0;
    for (const Eigen::Vector3f& move : moves.of_nodes) farthest = std::max(farthest, move.norm());
    EXPECT_NEAR(farthest, moved, 0.3 * moved);
    const exercise::Truth before = truth_of(*rigid.monitor(), rigid.simulation(), {});
    const exercise::Truth after = truth_of(*soft.monitor(), soft.simulation(), {});
    int differ = 0, in = 0;
    for (std::size_t i = 0; i < before.vessels.pixels.size(); ++i) {
        in += before.vessels.pixels[i] > 0;
        differ += before.vessels.pixels[i] != after.vessels.pixels[i];
    }
    EXPECT_GT(differ, 30);
    EXPECT_LT(differ, in / 2);
}

TEST(VesselsInTissue, HaveTheScenariosValuesForAllForOneOrNone) {
    const auto tissues = [](const std::string& text) {
        const auto s = scenario::parse_scenario(text, "tissue.toml", test::asset("devices"));
        return scenario::tissues_of(s, test::iliac_renal());
    };
    const std::string iliac = R"(schema = 1
title = "t"
[anatomy]
preset = "iliac-renal"
[entry]
end = "RCIA+REIA+RCFA.out"
inserted_mm = 60.0
[guidewire]
device = "bentson035"
[target]
centre_mm = [4.0, 0.0, 105.0]
)";
    EXPECT_TRUE(tissues(iliac).empty());
    EXPECT_TRUE(tissues(iliac + "[tissue]\nrigid = true\n").empty());
    EXPECT_EQ(tissues(iliac + "[tissue]\n"), anatomy::tissues_of(test::iliac_renal()));
    const auto some = tissues(
        iliac +
        "[tissue]\nmodulus_N_per_mm2 = 0.5\n[[tissue.vessel]]\nname = \"IMA\"\nwall_N_per_mm2 = 0.25\n");
    ASSERT_EQ(some.size(), test::iliac_renal().branches.size());
    for (std::size_t b = 0; b < some.size(); ++b) {
        EXPECT_EQ(some[b].modulus, 0.5);
        EXPECT_EQ(some[b].wall == 0.25, test::iliac_renal().branches[b].name == "IMA");
    }
    try {
        tissues(iliac + "[[tissue.vessel]]\nname = \"heart\"\n");
        FAIL();
    } catch (const io::InputError& error) {
        test::expect_said(error.what(), "'heart' is no vessel");
        test::expect_said(error.what(), "IMA");
    }
    for (const char* wrong : {"modulus_N_per_mm2 = 0\n", "modulus_N_per_mm2 = 0.001\n",
                              "wall_N_per_mm2 = -1\n", "modulus_N_per_mm2 = nan\n", "soft = 3\n"})
        EXPECT_THROW(tissues(iliac + "[tissue]\n" + wrong), io::InputError) << wrong;
    EXPECT_THROW(tissues(iliac + "[tissue]\n[relaxer]\nkind = \"segment\"\n"), io::InputError);
}
