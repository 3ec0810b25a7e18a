#include "physics/geometry/mesh_topology.h"

#include <gtest/gtest.h>

namespace geometry {
namespace {

/// The unit cube, twelve triangles that face out.
TriangleMesh cube() {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) mesh.vertices.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

}  // namespace

TEST(MeshTopology, ClosedCubeHasNoBoundaryAndItsVolume) {
    const Topology found = topology(cube());
    EXPECT_TRUE(found.loops.empty());
    EXPECT_EQ(found.boundary_edges, 0);
    EXPECT_EQ(found.non_manifold_edges, 0);
    EXPECT_DOUBLE_EQ(signed_volume(cube()), 1.0);
}

TEST(MeshTopology, InvertedCubeHasNegativeVolume) {
    TriangleMesh mesh = cube();
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    EXPECT_DOUBLE_EQ(signed_volume(mesh), -1.0);
}

TEST(MeshTopology, CapClosesAnOpenFaceOutward) {
    TriangleMesh mesh = cube();
    mesh.triangles.erase(mesh.triangles.begin() + 2, mesh.triangles.begin() + 4);  // z = 1
    const Topology open = topology(mesh);
    ASSERT_EQ(open.loops.size(), 1u);
    EXPECT_EQ(open.boundary_edges, 4);
    EXPECT_TRUE(open.loops[0].centroid.isApprox(Vec3(0.5, 0.5, 1)));
    const TriangleMesh closed = capped(mesh, open.loops);
    EXPECT_EQ(topology(closed).boundary_edges, 0);
    EXPECT_DOUBLE_EQ(signed_volume(closed), 1.0);
}

TEST(MeshTopology, EdgesThatDisagreeAboutOutsideAreNonManifold) {
    TriangleMesh mesh = cube();
    std::swap(mesh.triangles[0][1], mesh.triangles[0][2]);
    EXPECT_EQ(topology(mesh).non_manifold_edges, 3);
}

TEST(MeshTopology, TheFirstAtAPlaceIsFoundWhateverTheSignOfZero) {
    const std::vector<Vec3> vertices = {{1, 0, 0}, {2, 0, 0}, {1, -0.0, 0}, {2, 0, 0}, {1, 0, 1e-300}};
    EXPECT_EQ(first_at_place(vertices), (std::vector<int>{0, 1, 0, 1, 4}));
}

TEST(MeshTopology, WeldingJoinsEqualCornersAndDropsCollapsedTriangles) {
    TriangleMesh soup;
    for (const auto& t : cube().triangles) {
        const int first = static_cast<int>(soup.vertices.size());
        for (const int v : t) soup.vertices.push_back(cube().vertices[v]);
        soup.triangles.push_back({first, first + 1, first + 2});
    }
    soup.triangles.push_back({0, 0, 1});
    const TriangleMesh mesh = welded(soup);
    EXPECT_EQ(mesh.vertices.size(), 8u);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    EXPECT_EQ(topology(mesh).boundary_edges, 0);
}

}  // namespace geometry
