#include "engine/anatomy/mesh_file.h"

#include "engine/anatomy/mesh_topology.h"
#include "tests/engine/fixtures.h"

namespace engine {

TEST(MeshFile, BinaryStlIsReadAndWelded) {
    const physics::TriangleMesh mesh = load_mesh(test::asset("anatomy/iliac.stl"));
    EXPECT_EQ(mesh.triangles.size(), 51899u);
    const Topology found = topology(mesh);
    EXPECT_EQ(found.loops.size(), 8u);
    EXPECT_EQ(found.non_manifold_edges, 0);
}

TEST(MeshFile, MissingMeshIsNamed) {
    const std::string text = test::refusal([] { load_mesh("/nowhere/vessel.stl"); });
    EXPECT_NE(text.find("/nowhere/vessel.stl"), std::string::npos);
}

TEST(MeshFile, RubbishIsRefused) {
    const test::TemporaryFolder folder;
    test::write(folder / "vessel.stl", "this is not a mesh");
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "vessel.stl"); }), "");
}

TEST(MeshFile, TruncatedStlIsRefused) {
    const test::TemporaryFolder folder;
    test::write(folder / "vessel.stl", test::read(test::asset("anatomy/iliac.stl")).substr(0, 100'000));
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "vessel.stl"); }).find("vessel.stl"), std::string::npos);
}

TEST(MeshFile, CornersThatAreNotNumbersAreRefused) {
    const test::TemporaryFolder folder;
    test::write(folder / "vessel.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n");
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "vessel.obj"); }), "");
}

}  // namespace engine
