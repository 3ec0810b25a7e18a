#include "engine/anatomy/mesh_file.h"

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/mesh_topology.h"
#include "engine/scenes.h"
#include "tests/engine/fixtures.h"

namespace engine {
namespace {

Anatomy straight_tube() {
    return tube_anatomy("vessel", draw(std::vector<PenMove>{Run{40}}), 2.0, 24, 1.0);
}

}  // namespace

TEST(MeshFile, BinaryStlIsReadAndWelded) {
    const test::TemporaryFolder folder;
    const Anatomy tube = straight_tube();
    write_anatomy(tube, folder.path(), {});
    const physics::TriangleMesh mesh = load_mesh(folder / "vessel.stl");
    EXPECT_EQ(mesh.triangles.size(), tube.lumen.triangles.size());
    EXPECT_EQ(mesh.vertices.size(), tube.lumen.vertices.size());
    const Topology found = topology(mesh);
    EXPECT_EQ(found.loops.size(), 2u);
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
    write_anatomy(straight_tube(), folder.path(), {});
    test::write(folder / "vessel.stl", test::read(folder / "vessel.stl").substr(0, 50'000));
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "vessel.stl"); }).find("vessel.stl"), std::string::npos);
}

TEST(MeshFile, CornersThatAreNotNumbersAreRefused) {
    const test::TemporaryFolder folder;
    test::write(folder / "vessel.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n");
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "vessel.obj"); }), "");
}

}  // namespace engine
