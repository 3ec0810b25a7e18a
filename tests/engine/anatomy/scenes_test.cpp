#include "engine/anatomy/scenes.h"

#include <gtest/gtest.h>

#include "physics/geometry/mesh_topology.h"

namespace anatomy {

TEST(Scenes, RunsAndArcsHaveTheirLengthsAndEnds) {
    const std::vector<PenMove> path = {
        anatomy::Run{10}, Arc{5, std::numbers::pi / 2, geometry::Vec3::UnitZ()}, anatomy::Run{3}};
    EXPECT_NEAR(length(path), 13 + 2.5 * std::numbers::pi, 1e-12);
    const geometry::Polyline points = draw(path);
    // Chords as long as their arcs end R·δ²/24 a radian too far; δ = 0.05 / 5.
    EXPECT_LT((points.back() - geometry::Vec3(15, 8, 0)).norm(), 1e-4);
    for (std::size_t i = 1; i < points.size(); ++i)
        EXPECT_LE((points[i] - points[i - 1]).norm(), 0.05 + 1e-9);
}

TEST(Scenes, NegativeAngleTurnsTheOtherWay) {
    const geometry::Polyline points =
        draw(std::vector<PenMove>{Arc{5, -std::numbers::pi / 2, geometry::Vec3::UnitZ()}});
    EXPECT_LT((points.back() - geometry::Vec3(5, -5, 0)).norm(), 1e-4);
}

TEST(Scenes, SpatialSceneIsAsLongAsItsPenMoves) {
    const Scene* scene = find_scene("spatial");
    ASSERT_NE(scene, nullptr);
    EXPECT_NEAR(length(scene->path), 179.1, 0.05);
    const geometry::Polyline points = draw(scene->path);
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
        EXPECT_EQ(geometry::topology(anatomy.lumen).loops.size(), 2u) << scene.name;
        EXPECT_TRUE(inside(anatomy, anatomy.targets[0].centre)) << scene.name;
    }
}

}  // namespace anatomy
