/// The demo as it ships: the wire reaches its target whole, and never deeper in the wall than its force
/// explains.

#include <gtest/gtest.h>

#include "engine/exercise.h"
#include "physics/energy.h"

TEST(Demo, ReachesTheLeftRenalArteryWithAWholeWire) {
    const std::string assets = SELDINGER_SOURCE "/assets/";
    const engine::Scenario scenario = engine::load_scenario(assets + "scenarios/renal.toml");
    const engine::CommandScript script = engine::load_commands(assets + "scripts/renal.gw");
    engine::Exercise exercise(scenario, false);
    auto next = script.commands.begin();
    for (int frame = 0; frame <= script.last_frame(10); ++frame) {
        std::vector<engine::Command> commands;
        for (; next != script.commands.end() && next->frame == frame; ++next)
            commands.push_back(next->command);
        exercise.next_frame(commands);
        const physics::Guidewire& wire = exercise.simulation().wire();
        const auto broken = physics::validate(wire);  // finite, tangents unit, joints λ apart to 1e-9
        ASSERT_TRUE(broken.empty()) << "frame " << frame << ": " << broken.front();
        for (const physics::WallContact& c : exercise.simulation().contacts().subspan(1)) {
            ASSERT_LE(c.penetration, 0.3) << "frame " << frame;
            ASSERT_DOUBLE_EQ(c.force(), c.touches() ? scenario.wall_stiffness * c.penetration : 0.0);
        }
    }
    const engine::Score score = exercise.score();
    EXPECT_TRUE(score.completed);
    std::printf("tip %.2f mm from the target, deepest contact %.4f mm, largest force %.3f N\n",
                score.tip_to_target, score.deepest.penetration, score.peak_wall_force);
}
