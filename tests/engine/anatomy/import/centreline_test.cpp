#include <gtest/gtest.h>

#include "engine/anatomy/import/branch_tree.h"
#include "engine/anatomy/import/mesh_cut.h"
#include "tests/engine/anatomy/tubes.h"

namespace anatomy {

using geometry::Polyline;
using geometry::Vec3;

TEST(Centreline, IsRecentredInABentTube) {
    const geometry::MeshQuery wall(test::tube(2, 40, 48, 15));
    Polyline rough;
    for (double a = 0.1; a < 2.5; a += 0.05)  // off by half the radius and wavy
        rough.push_back({(14 + 0.3 * std::sin(20 * a)) * std::sin(a), 15 - 14 * std::cos(a), 0.5});
    const Centreline line = recentred(rough, wall, 0.4, false, false);
    for (std::size_t i = 0; i < line.points.size(); ++i) {
        const Vec3& p = line.points[i];
        EXPECT_LT(std::hypot(std::hypot(p.x(), p.y() - 15) - 15, p.z()), 0.05);
        EXPECT_NEAR(line.radii[i], 2, 0.06);
    }
}

TEST(Centreline, FixedEndsStay) {
    const geometry::MeshQuery wall(test::tube(2, 20));
    const Centreline line = recentred({{0, 0.5, 0}, {10, 0.5, 0.3}, {20, 0.5, 0}}, wall, 0.5, true, true);
    EXPECT_EQ(line.points.front(), Vec3(0, 0.5, 0));
    EXPECT_EQ(line.points.back(), Vec3(20, 0.5, 0));
    EXPECT_LT((line.points[20] - Vec3(10, 0, 0)).norm(), 0.05);
}

TEST(MeshCut, OpensATubeWithOneLoopInThePlane) {
    geometry::TriangleMesh mesh = test::tube(2, 20);
    mesh = geometry::capped(mesh, geometry::topology(mesh).loops);
    const Vec3 normal = Vec3(1, 0.1, 0).normalized(), centre(16, 0, 0);
    MeshCut cutting(mesh);
    ASSERT_TRUE(cutting.beyond(centre, normal, {20, 0, 0}, 10, 3));
    const geometry::TriangleMesh cut = cutting.result();
    const geometry::Topology found = geometry::topology(cut);
    ASSERT_EQ(found.loops.size(), 1u);
    EXPECT_EQ(found.non_manifold_edges, 0);
    for (const int v : found.loops[0].vertices) EXPECT_NEAR((cut.vertices[v] - centre).dot(normal), 0, 1e-5);
    EXPECT_NEAR(geometry::signed_volume(geometry::capped(cut, found.loops)),
                geometry::signed_volume(mesh) * 0.8, 0.02 * geometry::signed_volume(mesh));
}

}  // namespace anatomy
