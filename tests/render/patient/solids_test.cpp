#include "render/patient/solids.h"

#include <gtest/gtest.h>

#include "physics/geometry/mesh_topology.h"
#include "render/xray/path_length.h"

TEST(Solids, SubdividedKeepTheirSurface) {
    const geometry::TriangleMesh ball =
        render::ellipsoid(geometry::Vec3(4, 5, 6), geometry::Vec3(30, 20, 25));
    const geometry::TriangleMesh finer = render::subdivided(ball);
    EXPECT_EQ(finer.triangles.size(), 4 * ball.triangles.size());
    // Each edge, shared by two triangles, adds its middle.
    EXPECT_EQ(finer.vertices.size(), ball.vertices.size() + 3 * ball.triangles.size() / 2);
    EXPECT_EQ(render::unmatched_edges(finer), 0);
    EXPECT_NEAR(geometry::signed_volume(finer) / geometry::signed_volume(ball), 1.0, 1e-12);
}
