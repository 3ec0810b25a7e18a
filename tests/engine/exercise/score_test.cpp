#include "engine/exercise/score.h"

#include <functional>
#include <nlohmann/json.hpp>

#include "engine/exercise/exercise.h"
#include "engine/exercise/score_file.h"
#include "physics/wire/energy.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using Look = std::function<void(int frame, const Simulation&)>;

/// Runs a script and scores every frame; `look` sees each.
Score score_of(const scenario::Scenario& scenario, const std::string& script, const Look& look = {}) {
    Exercise exercise(scenario, false);
    int frame = 0;
    test::play(exercise, script, [&](const auto&, const auto&) {
        if (look) look(frame, exercise.simulation());
        ++frame;
    });
    return exercise.score();
}

}  // namespace

TEST(Score, CompletionRunsFromTheFirstMotionToTheEndOfTheHold) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.target.name = "";
    scenario.target.centre = geometry::Vec3(22, 0, 0);
    scenario.target.radius = 3.0;  // the tip starts about 20 mm along, so at once inside
    // Motion begins with frame 5; the hold of 0.2 s is 3 frames at 15 Hz and has passed by then.
    const Score score = score_of(scenario, "5 rotate 1 deg\n20 end\n");
    EXPECT_TRUE(score.completed);
    EXPECT_NEAR(*score.completion_time, 1 / 15.0, 1e-12);
    EXPECT_EQ(score.frames, 21);
}

TEST(Score, HoldMustPassBeforeTheTargetCounts) {
    const scenario::Scenario scenario = test::small_scenario();
    const std::string way = "0..23 advance 2 mm\n";
    const Score all = score_of(scenario, way + "60 end\n");
    ASSERT_TRUE(all.completed);
    const int frames = static_cast<int>(std::lround(*all.completion_time * 15));
    EXPECT_FALSE(score_of(scenario, "0.." + std::to_string(std::min(23, frames - 2)) + " advance 2 mm\n" +
                                        std::to_string(frames - 2) + " end\n")
                     .completed);
    EXPECT_TRUE(score_of(scenario, "0.." + std::to_string(std::min(23, frames - 1)) + " advance 2 mm\n" +
                                       std::to_string(frames - 1) + " end\n")
                    .completed);
}

TEST(Score, StoppedWithdrawalCountsOnlyWhatMoved) {
    const Score score = score_of(test::small_scenario(), "0 withdraw 100 mm\n2 end\n");
    EXPECT_LT(score.wire_travel, 20);
    EXPECT_GT(score.wire_travel, 0);
}

TEST(Score, DeepestContactIsExplainedByItsForce) {
    const std::string script = "0..20 advance 2 mm\n";
    const Score score = score_of(test::small_scenario(), script);
    const int joint = score.deepest.joint;
    ASSERT_GE(joint, 1);
    EXPECT_GT(score.deepest.penetration, 0);
    // The walls press with what the bent wire needs: no joint has a force left over. Without the
    // deepest contact the wire's bending pulls at it with that force, as far as it lies across the segment.
    bool seen = false;
    score_of(test::small_scenario(), script, [&](int frame, const Simulation& simulation) {
        if (frame != score.deepest.frame) return;
        seen = true;
        const physics::Chain& wire = simulation.wire();
        auto contacts = physics::all_contacts(wire, simulation.wall());
        EXPECT_LE(physics::relative_gradient(wire, contacts), 2e-8);
        const double across = contacts[joint].normal.cross(wire.tangents[joint]).norm();
        contacts[joint] = {};
        const auto left = physics::energy_gradient(wire, contacts);
        EXPECT_GT(across, 0.5);
        EXPECT_NEAR(left[joint].norm(), wire.lengths[joint] * across * score.deepest.force,
                    1e-3 * left[joint].norm());
        for (int i = joint + 1; i <= wire.segments(); ++i)
            EXPECT_LE(left[i].norm() / wire.spring_constant(i - 1), 2e-8) << i;
    });
    EXPECT_TRUE(seen);
    // One stiffness everywhere except at the tip, which stands for half a segment: where the tip is deepest,
    // a joint less deep may be pressed harder.
    const double fraction = score.peak_wall_force / score.deepest.force;
    EXPECT_GE(fraction, 1 - 1e-12);
    EXPECT_LE(fraction, 2);
    EXPECT_GT(score.wall_force_impulse, 0);
}

TEST(Score, ResetBeginsANewAttempt) {
    const Score score =
        score_of(test::small_scenario(), "0..4 advance 2 mm\n10 reset\n12 advance 4 mm\n20 end\n");
    EXPECT_NEAR(score.wire_travel, 4, 1e-9);
    EXPECT_EQ(score.resets, 1);
    EXPECT_EQ(score.frames, 21);
}

TEST(Score, JsonNamesUnitsAndKeepsEveryBit) {
    Score score;
    score.wire_travel = 1.0 / 3;
    const auto json = nlohmann::json::parse(to_json({"test", "", score, {}, {}}));
    for (const char* key : {"completed", "completion_time_s", "beam_on_time_s", "wire_travel_mm",
                            "peak_wall_force_N", "max_penetration_mm", "frames"}) {
        EXPECT_TRUE(json.contains(key)) << key;
    }
    EXPECT_EQ(json["wire_travel_mm"].get<double>(), 1.0 / 3);
    EXPECT_TRUE(json["completion_time_s"].is_null());
}

}  // namespace exercise
