/// The demo as it ships: in every frame the wire is whole, at rest, and no deeper in the wall than its force
/// explains; it reaches its target, also when the hand is not exact or the wall another.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace {

const std::string assets = SELDINGER_SOURCE "/assets/";

/// Runs the shipped script of that name, each rotation `turn` times as far; `look` sees every frame.
exercise::Score run(
    const scenario::Scenario& scenario, const std::string& name, double turn,
    const std::function<void(int, const exercise::Simulation&, const exercise::StepReport&)>& look) {
    const script::CommandScript script = script::load_commands(assets + "scripts/" + name + ".gw");
    exercise::Exercise exercise(scenario, false, test::cache());
    for (int frame = 0; frame <= script.last_frame(10); ++frame) {
        std::vector<script::Command> commands;
        for (const script::TimedCommand& timed : script.at(frame)) {
            commands.push_back(timed.command);
            if (auto* rotation = std::get_if<script::Rotate>(&commands.back())) rotation->angle *= turn;
        }
        const exercise::StepReport report = exercise.next_frame(commands).motion;
        look(frame, exercise.simulation(), report);
    }
    return exercise.score();
}

class Demo : public testing::TestWithParam<const char*> {};

}  // namespace

TEST_P(Demo, ReachesItsTargetAtRestInEveryFrame) {
    const scenario::Scenario scenario = test::shipped_scenario(GetParam());
    const auto look = [&](int frame, const exercise::Simulation& simulation,
                          const exercise::StepReport& report) {
        EXPECT_TRUE(report.relax.converged() && report.relax.gradient <= 1e-8) << "frame " << frame;
        const physics::Chain& wire = simulation.wire();
        const auto broken = physics::validate(wire);  // finite, tangents unit, joints λ apart to 1e-9
        ASSERT_TRUE(broken.empty()) << "frame " << frame << ": " << broken.front();
        for (const physics::WallContact& c : simulation.contacts().subspan(1)) {
            ASSERT_LE(c.pressed_in(), 0.3) << "frame " << frame;
        }
        // The walls press with what the bent wire needs: without the deepest contact it is not at
        // rest.
        auto contacts = physics::all_contacts(wire, simulation.wall());
        EXPECT_LE(physics::relative_gradient(wire, contacts), 2e-8) << "frame " << frame;
        const auto deepest =
            std::max_element(contacts.begin(), contacts.end(),
                             [](const auto& a, const auto& b) { return a.force() < b.force(); });
        if (deepest->force() < 1e-3) return;
        *deepest = {};
        EXPECT_GT(physics::relative_gradient(wire, contacts), 1e-6) << "frame " << frame;
    };
    const exercise::Score score = run(scenario, GetParam(), 1.0, look);
    EXPECT_TRUE(score.completed);
    RecordProperty("tip_to_target_mm", std::to_string(score.tip_to_target));
    RecordProperty("deepest_mm", std::to_string(score.deepest.penetration));
    RecordProperty("peak_wall_force_N", std::to_string(score.peak_wall_force));
}

TEST_P(Demo, ForgivesAnInexactHandAndAnotherWall) {
    for (const double turn : {0.95, 1.05}) {
        for (const double stiffness : {0.5, 2.0}) {
            scenario::Scenario scenario = test::shipped_scenario(GetParam());
            scenario.wall_stiffness *= stiffness;
            const exercise::Score score = run(scenario, GetParam(), turn, [](auto&&...) {});
            EXPECT_TRUE(score.completed) << "rotations " << turn << ", stiffness " << stiffness << ": tip "
                                         << score.tip_to_target << " mm from the target";
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Shipped, Demo, testing::Values("renal", "arch", "coronary", "iliac_aorta", "s_bend"),
                         [](const auto& one) { return std::string(one.param); });
