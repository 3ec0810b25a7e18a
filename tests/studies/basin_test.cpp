/// Whether the global relaxer ends in the basin that a wire moved very slowly comes to rest in.

#include <gtest/gtest.h>

#include "engine/studies/slow_flow.h"
#include "physics/relax/relaxer.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// Pushes the wire in up to `segments`; every `every`-th push is made by the slow flow too, from the same
/// state. Returns the wire where the last push left it.
Chain expect_same_basin(const char* name, Chain wire, const LumenWall& wall, int segments, int every) {
    const auto relaxer = global_relaxer(wall);
    relaxer->relax(wire, unlimited);
    int pushes = 0;
    double farthest = 0;
    while (wire.segments() < segments) {
        move(wire, wire.grid.segment_length);
        Chain slow = wire;
        EXPECT_TRUE(relaxer->relax(wire, unlimited).converged()) << name << " " << wire.segments();
        if (wire.segments() % every != 0) continue;
        EXPECT_TRUE(studies::flow_to_rest(slow, wall).at_rest);
        const double apart = farthest_apart(wire, slow);
        EXPECT_LT(apart, 0.05) << name << " at " << wire.segments() << " segments";
        farthest = std::max(farthest, apart);
        ++pushes;
    }
    testing::Test::RecordProperty("pushes", pushes);
    testing::Test::RecordProperty("farthest_from_the_slow_flow_mm", std::to_string(farthest));
    return wire;
}

}  // namespace

TEST(Basin, APushEndsWhereAVerySlowOneDoes) {
    for (const auto& [name, every] :
         {std::pair{"sinuous", 1}, {"spatial", 1}, {"hairpin", 1}, {"stiffwall", 3}}) {
        auto [wall, wire] = scene_setup(name);
        const int segments = wire.segments();
        expect_same_basin(name, wire_along(wire.devices[0].spec, wire.grid, wall.centreline(), 20), wall,
                          segments, every);
    }
}

TEST(Basin, APushOfALongWireEndsWhereAVerySlowOneDoes) {
    const auto [wall, wire] = long_scene(575);
    expect_same_basin("long", wire, wall, 589, 1);
}

TEST(Basin, AFoldedWireStaysFoldedAsItIsPushed) {
    std::vector<Vec3> tangents(20, Vec3::UnitX());
    for (int i = 0; i < 12; ++i) {
        const double angle = M_PI * (i + 0.5) / 12;
        tangents.emplace_back(std::cos(angle), std::sin(angle), 0);
    }
    tangents.insert(tangents.end(), 20, -Vec3::UnitX());
    const Chain wire = uniform_wire(50, 1.0, {0, -3.8, 0}, {1, 0, 0}, tangents);
    const TubeWall wall({{-8, 0, 0}, {60, 0, 0}}, 4.5, 42);  // the tip runs into its near end
    const Chain pushed = expect_same_basin("folded", wire, wall, 72, 1);
    EXPECT_GT(pushed.tangents[15].x(), 0.5);
    EXPECT_LT(pushed.tangents[45].x(), -0.5);
}
