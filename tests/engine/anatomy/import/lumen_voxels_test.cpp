#include "engine/anatomy/import/lumen_voxels.h"

#include <gtest/gtest.h>

#include "tests/engine/anatomy/tubes.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

TriangleMesh closed_tube(double radius, double length, double bend = 0) {
    const TriangleMesh open = test::tube(radius, length, 32, bend);
    return geometry::capped(open, geometry::topology(open).loops);
}

}  // namespace

TEST(LumenVoxels, FillTheVolumeOfABentTube) {
    const TriangleMesh mesh = closed_tube(2, 40, 25);
    const LumenVoxels voxels(mesh, 0.3);
    EXPECT_NEAR(voxels.count() * 0.027, geometry::signed_volume(mesh), 0.01 * geometry::signed_volume(mesh));
    for (int i = 0; i < voxels.count(); i += 97) {
        const Vec3 p = voxels.centre(i);
        EXPECT_LT(std::hypot(std::hypot(p.x(), p.y() - 25) - 25, p.z()), 2.001);
    }
}

TEST(LumenVoxels, OverlappingTubesAreInsideTwiceAndNotOut) {
    TriangleMesh mesh = closed_tube(2, 20);
    TriangleMesh other = closed_tube(2, 20);
    for (Vec3& v : other.vertices) v += Vec3(0, 1.5, 0);
    test::append(mesh, other);
    const LumenVoxels voxels(mesh, 0.25);
    const int nearest = voxels.nearest({10, 0.75, 0});  // inside both
    EXPECT_LT((voxels.centre(nearest) - Vec3(10, 0.75, 0)).norm(), 0.25);
}

TEST(LumenVoxels, DistancesAreThoseOfTheWallForAnyNumberOfThreads) {
    const TriangleMesh open = test::tube(3, 20, 48);
    const geometry::MeshQuery wall(open);
    const LumenVoxels voxels(geometry::capped(open, geometry::topology(open).loops), 0.25);
    const std::vector<float> distances = voxels.distances(wall, 1);
    for (int i = 0; i < voxels.count(); i += 13)
        EXPECT_NEAR(distances[i], wall.distance(voxels.centre(i)),
                    0.15 * wall.distance(voxels.centre(i)) + 0.02);
    EXPECT_EQ(distances, voxels.distances(wall, 3));
}

TEST(LumenVoxels, CheapestWaysKeepToTheMiddle) {
    const TriangleMesh open = test::tube(2, 40, 32, 25);
    const LumenVoxels voxels(geometry::capped(open, geometry::topology(open).loops), 0.3);
    const std::vector<float> distances = voxels.distances(geometry::MeshQuery(open), 1);
    const int root = voxels.nearest({0, 0, 0}),
              goal = voxels.nearest({25 * std::sin(1.6), 25 - 25 * std::cos(1.6), 0});
    const VoxelPaths ways = cheapest_paths(voxels, distances, root);
    ASSERT_TRUE(ways.reached(goal));
    EXPECT_EQ(ways.path(goal).back(), root);
    for (const int v : ways.path(goal)) {
        const Vec3 p = voxels.centre(v);
        EXPECT_LT(std::hypot(std::hypot(p.x(), p.y() - 25) - 25, p.z()), 0.8);
    }
}

}  // namespace anatomy
