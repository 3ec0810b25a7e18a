#include "engine/scenes.h"

#include <gtest/gtest.h>

#include "engine/anatomy/mesh_topology.h"

namespace engine {

TEST(Scenes, RunsAndArcsHaveTheirLengthsAndEnds) {
    const std::vector<PenMove> path = {engine::Run{10}, Arc{5, std::numbers::pi / 2, physics::Vec3::UnitZ()},
                                       engine::Run{3}};
    EXPECT_NEAR(length(path), 13 + 2.5 * std::numbers::pi, 1e-12);
    const physics::Polyline points = draw(path);
    EXPECT_TRUE(points.back().isApprox(physics::Vec3(15, 8, 0), 1e-12));
    for (std::size_t i = 1; i < points.size(); ++i)
        EXPECT_LE((points[i] - points[i - 1]).norm(), 0.05 + 1e-9);
}

TEST(Scenes, NegativeAngleTurnsTheOtherWay) {
    const physics::Polyline points =
        draw(std::vector<PenMove>{Arc{5, -std::numbers::pi / 2, physics::Vec3::UnitZ()}});
    EXPECT_TRUE(points.back().isApprox(physics::Vec3(5, -5, 0), 1e-12));
}

TEST(Scenes, SpatialSceneIsAsLongAsItsPenMoves) {
    const Scene* scene = find_scene("spatial");
    ASSERT_NE(scene, nullptr);
    EXPECT_NEAR(length(scene->path), 179.1, 0.05);
    const physics::Polyline points = draw(scene->path);
    double drawn = 0;
    for (std::size_t i = 1; i < points.size(); ++i) drawn += (points[i] - points[i - 1]).norm();
    EXPECT_NEAR(drawn, length(scene->path), 1e-3);
}

TEST(Scenes, UnknownSceneIsNull) {
    EXPECT_EQ(find_scene("corkscrew"), nullptr);
}

TEST(Scenes, EverySceneMakesASoundAnatomyOpenAtTwoEnds) {
    for (const Scene& scene : scenes()) {
        const Anatomy anatomy =
            tube_anatomy(std::string(scene.name), draw(scene.path), scene.radius, 24, 0.5);
        EXPECT_TRUE(problems(anatomy).empty()) << scene.name;
        EXPECT_EQ(topology(anatomy.lumen).loops.size(), 2u) << scene.name;
        EXPECT_TRUE(inside(anatomy, anatomy.targets[0].centre)) << scene.name;
    }
}

}  // namespace engine
