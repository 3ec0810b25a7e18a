#include "engine/anatomy/mesh_file.h"

#include "engine/anatomy/anatomy_writer.h"
#include "physics/geometry/mesh_topology.h"
#include "tests/engine/anatomy/mesh_texts.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/anatomy/tubes.h"
#include "tests/engine/fixtures.h"

namespace anatomy {

namespace {

/// What is said of a file of this text; empty where it is read.
std::string refusal_of(const test::TemporaryFolder& folder, const char* name, const std::string& text) {
    test::write(folder / name, text);
    return test::refusal([&] { load_mesh(folder / name); });
}

}  // namespace

using MeshFile = test::InFolder;

TEST_F(MeshFile, BinaryStlIsReadAndWelded) {
    const Anatomy tube = test::straight_tube("vessel");
    write_anatomy(tube, folder.path(), {});
    const geometry::TriangleMesh mesh = load_mesh(folder / "vessel.stl");
    EXPECT_EQ(mesh.triangles.size(), tube.lumen.triangles.size());
    EXPECT_EQ(mesh.vertices.size(), tube.lumen.vertices.size());
    const geometry::Topology found = geometry::topology(mesh);
    EXPECT_EQ(found.loops.size(), 2u);
    EXPECT_EQ(found.non_manifold_edges, 0);
}

TEST_F(MeshFile, MissingMeshIsNamed) {
    test::expect_refusal([] { load_mesh("/nowhere/vessel.stl"); }, "/nowhere/vessel.stl");
}

TEST_F(MeshFile, CornersThatAreNotNumbersAreRefused) {
    EXPECT_NE(refusal_of(folder, "vessel.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n"), "");
}

TEST_F(MeshFile, SaysWhatIsReadWhereItIsNot) {
    test::expect_said(refusal_of(folder, "vessel.stp", "ISO-10303-21;"),
                      "'.stp' is not read; expected an STL, OBJ, PLY, OFF, VTP, VTK, GLB or glTF file");
    test::expect_said(refusal_of(folder, "vessel.vtp", "<VTKFile/>"), "expected type 'PolyData'");
    test::expect_said(refusal_of(folder, "text.stl", "dear diary, this is not a mesh"),
                      "or a text STL from 'solid' to 'endsolid'");
    test::expect_said(
        refusal_of(folder, "half.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
        "half.stl:5: the end of the file was found; expected 'vertex' 2 of 3 of a facet");
    EXPECT_NE(refusal_of(folder, "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "");
    const char* const header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n123";
    EXPECT_NE(refusal_of(folder, "half.ply", header), "");
    write_anatomy(test::straight_tube("vessel"), folder.path(), {});
    test::expect_said(refusal_of(folder, "vessel.stl", test::read(folder / "vessel.stl").substr(0, 50'000)),
                      "vessel.stl");
}

TEST_F(MeshFile, AWrongLineOfATextIsNamed) {
    const std::string stl = test::text_stl(test::tube(2, 6, 6));
    const auto said = [&](const char* name, std::string text, const std::string& from,
                          const std::string& to) {
        return refusal_of(folder, name, test::replaced(std::move(text), from, to));
    };
    EXPECT_EQ(said("a.stl", stl, "solid a tube", "SOLID"), "");
    EXPECT_EQ(said("a.stl", stl, "facet normal 0 0 1", "facet normal nan nan nan"), "");
    test::expect_said(said("a.stl", stl, "vertex 0 ", "vertex 0,5 "),
                      "a.stl:4: '0,5' was found; expected a finite number, x of a corner");
    test::expect_said(said("a.stl", stl, "vertex 0 ", "vertex inf "), "a.stl:4: 'inf' was found");
    test::expect_said(said("a.stl", stl, "vertex 0 ", "vertex "),
                      "a.stl:5: 'vertex' was found; expected a finite number");
    test::expect_said(said("a.stl", stl, "endloop", "vertex 1 2 3"),
                      "a.stl:7: 'vertex' was found; expected 'endloop' behind three vertices");
    test::expect_said(said("a.stl", stl, "endsolid a tube", ""),
                      "the end of the file was found; expected 'endsolid'");
    const std::string off = test::off(test::tube(2, 6, 6));
    test::expect_said(said("a.off", off, "\n3 0 1 ", "\n3 0 99 "),
                      "'99' was found; expected a corner's index, a whole");
    test::expect_said(said("a.off", off, "OFF", "OF"), "a.off:1: 'OF' was found; expected 'OFF'");
    test::expect_said(said("a.off", off, "\n24 36 ", "\n2400 3600 "),
                      "a.off:2: '2400' was found; expected as many corners");
}

TEST_F(MeshFile, GltfThatDoesNotFitTogetherIsRefused) {
    const auto said = [&](const std::string& from, const std::string& to) {
        EXPECT_EQ(from.size(), to.size());
        return refusal_of(folder, "a.glb", test::replaced(test::glb(test::tube(2, 6, 6)), from, to));
    };
    EXPECT_EQ(said("99", "98"), "");
    test::expect_said(said("\"children\":[1]", "\"children\":[0]"), "its parents form a circle");
    test::expect_said(said("\"mesh\":0", "\"mesh\":1"), "node 1: mesh: 1 was found; expected 0 to 0");
    test::expect_said(said("\"bufferView\":1", "\"bufferView\":0"), "it needs");
    test::expect_said(said("\"POSITION\":0", "\"POSITION\":9"), "9 was found; expected 0 to 1");
    test::expect_said(said("\"VEC3\"", "\"VEC2\""), "POSITION is not of three floats");
    test::expect_said(said("\"asset\"", "\"assez\""), "this is not glTF");
}

TEST_F(MeshFile, HugeFilesAreRefusedUnread) {
    test::write(folder / "zeros.stl", "");
    std::filesystem::resize_file(folder / "zeros.stl", std::uintmax_t{2} << 30);
    test::expect_refusal([&] { load_mesh(folder / "zeros.stl"); }, "2147483648 bytes were found");
    const std::uint32_t count = 10'000'000;
    std::string header(80, ' ');
    header.append(reinterpret_cast<const char*>(&count), sizeof count);
    test::write(folder / "many.stl", header);
    std::filesystem::resize_file(folder / "many.stl", 84 + std::uintmax_t{50} * count);
    const std::string text = test::refusal([&] { load_mesh(folder / "many.stl"); });
    test::expect_said(text, "10 million triangles would need 4.5 GB");
    test::expect_said(text, "expected 4 million");
    test::write(folder / "zeros.obj", "");
    std::filesystem::resize_file(folder / "zeros.obj", std::uintmax_t{2} << 30);
    test::expect_refusal([&] { load_mesh(folder / "zeros.obj"); }, "GB of memory");
}

TEST_F(MeshFile, AnObjFaceOfManyCornersIsRefusedUnread) {
    const auto with_face = [&](int corners, const std::string& between, const std::string& kind = "f") {
        std::string text;
        for (int k = 0; k < corners; ++k)
            text += fmt::format("v {} {} 0\n", std::cos(6.283 * k / corners), std::sin(6.283 * k / corners));
        text += kind;
        for (int k = 0; k < corners; ++k) text += fmt::format("{}{}", between, k + 1);
        test::write(folder / "face.obj", text + "\n");
        return test::refusal([&] { load_mesh(folder / "face.obj"); });
    };
    EXPECT_EQ(with_face(1000, " "), "");
    for (const char* between : {" ", "\t", " \\\n ", " \\\r\n"})
        for (const int corners : {1001, 200000}) {
            const std::string said = with_face(corners, between);
            EXPECT_NE(said.find("expected a face of at most"), std::string::npos) << corners << said;
            test::expect_said(said, fmt::format("line {}:", corners + 1));
        }
    test::expect_said(with_face(200000, " ", "l"), "1000");
}

}  // namespace anatomy
