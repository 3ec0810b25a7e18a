#include "engine/anatomy/mesh_file.h"

#include "engine/anatomy/anatomy_writer.h"
#include "physics/geometry/mesh_topology.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
TEST(MeshFile, BinaryStlIsReadAndWelded) {
    const test::TemporaryFolder folder;
    const Anatomy tube = test::straight_tube("vessel");
    write_anatomy(tube, folder.path(), {});
    const geometry::TriangleMesh mesh = load_mesh(folder / "vessel.stl");
    EXPECT_EQ(mesh.triangles.size(), tube.lumen.triangles.size());
    EXPECT_EQ(mesh.vertices.size(), tube.lumen.vertices.size());
    const geometry::Topology found = geometry::topology(mesh);
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
    write_anatomy(test::straight_tube("vessel"), folder.path(), {});
    test::write(folder / "vessel.stl", test::read(folder / "vessel.stl").substr(0, 50'000));
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "vessel.stl"); }).find("vessel.stl"), std::string::npos);
}

TEST(MeshFile, CornersThatAreNotNumbersAreRefused) {
    const test::TemporaryFolder folder;
    test::write(folder / "vessel.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n");
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "vessel.obj"); }), "");
}

TEST(MeshFile, SaysWhatIsReadWhereItIsNot) {
    const test::TemporaryFolder folder;
    test::write(folder / "vessel.vtp", "<VTKFile/>");
    EXPECT_NE(test::refusal([&] {
                  load_mesh(folder / "vessel.vtp");
              }).find("'.vtp' is not read; .stl, .obj and .ply"),
              std::string::npos);
    test::write(folder / "text.stl", "dear diary, this is not a mesh");
    EXPECT_NE(test::refusal([&] {
                  load_mesh(folder / "text.stl");
              }).find("from 'solid' to 'endsolid', is accepted"),
              std::string::npos);
    test::write(folder / "half.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n");
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "half.stl"); }).find("its end is missing"),
              std::string::npos);
    test::write(folder / "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "points.obj"); }), "");
    test::write(folder / "half.ply",
                "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n123");
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "half.ply"); }), "");
}

TEST(MeshFile, HugeFilesAreRefusedUnread) {
    const test::TemporaryFolder folder;
    test::write(folder / "zeros.stl", "");
    std::filesystem::resize_file(folder / "zeros.stl", std::uintmax_t{2} << 30);
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "zeros.stl"); }).find("2147483648 bytes were found"),
              std::string::npos);
    const std::uint32_t count = 10'000'000;
    std::string header(80, ' ');
    header.append(reinterpret_cast<const char*>(&count), sizeof count);
    test::write(folder / "many.stl", header);
    std::filesystem::resize_file(folder / "many.stl", 84 + std::uintmax_t{50} * count);
    const std::string text = test::refusal([&] { load_mesh(folder / "many.stl"); });
    EXPECT_NE(text.find("10 million triangles would need 4.5 GB"), std::string::npos) << text;
    EXPECT_NE(text.find("4 million are accepted"), std::string::npos) << text;
    test::write(folder / "zeros.obj", "");
    std::filesystem::resize_file(folder / "zeros.obj", std::uintmax_t{2} << 30);
    EXPECT_NE(test::refusal([&] { load_mesh(folder / "zeros.obj"); }).find("GB of memory"),
              std::string::npos);
}

}  // namespace anatomy
