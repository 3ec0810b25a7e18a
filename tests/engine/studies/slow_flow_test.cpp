#include "engine/studies/slow_flow.h"

#include <gtest/gtest.h>

#include "physics/wire/energy.h"
#include "tests/physics/wires.h"

namespace studies {

TEST(SlowFlow, ReachesAMinimumThatOtherSolversFound) {
    auto [wall, wire] = scene_setup("sinuous");
    const SlowFlowReport report = flow_to_rest(wire, wall);
    EXPECT_NEAR(report.energy, 5.808955, 2e-6);
    EXPECT_LE(report.gradient, 1e-7);
    EXPECT_TRUE(physics::validate(wire).empty());
}

TEST(SlowFlow, BringsACurvedTipToRest) {
    physics::Chain wire = bent_wire(40, 0.8);
    const physics::TubeWall wall({{-100, -2, 3}, {200, -2, 3}}, 1000, 10);  // nothing in reach
    const SlowFlowReport report = flow_to_rest(wire, wall);
    EXPECT_LE(report.gradient, 1e-8);
    EXPECT_LE(report.energy, 1e-12);  // the unloaded shape
}

TEST(SlowFlow, NeverMovesAJointFartherThanItsStride) {
    auto [wall, wire] = scene_setup("hairpin");
    const auto before = wire.joints;
    flow_to_rest(wire, wall, {0.01, 1e-9, 5});
    for (std::size_t i = 0; i < before.size(); ++i)
        EXPECT_LE((wire.joints[i] - before[i]).norm(), 5 * 0.01 + 1e-9);
}

}  // namespace studies
