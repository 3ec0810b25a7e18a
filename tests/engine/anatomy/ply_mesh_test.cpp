#include "engine/anatomy/ply_mesh.h"

#include <gtest/gtest.h>

#include "tests/engine/anatomy/mesh_texts.h"
#include "tests/engine/anatomy/tubes.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using test::expect_said;
using test::refusal;

std::string ply_head(const std::string& order, std::size_t corners, std::size_t faces) {
    return fmt::format(
        "ply\r\nformat {} 1.0\ncomment by hand\nelement vertex {}\nproperty uchar red\nproperty double x\n"
        "property float y\nproperty float z\nelement face {}\nproperty list ushort uint vertex_index\n"
        "property float quality\nelement edge 1\nproperty list uchar char of\nend_header\n",
        order, corners, faces);
}

std::string text_ply(const TriangleMesh& mesh) {
    std::string text = ply_head("ascii", mesh.vertices.size(), mesh.triangles.size());
    for (const auto& v : mesh.vertices) text += fmt::format("255 {} {} {}\n", v.x(), v.y(), v.z());
    for (const auto& t : mesh.triangles) text += fmt::format("3 {} {} {} 0.5\n", t[0], t[1], t[2]);
    return text + "2 7 8";
}

std::string binary_ply(const TriangleMesh& mesh, bool big) {
    std::string bytes = ply_head(big ? "binary_big_endian" : "binary_little_endian", mesh.vertices.size(),
                                 mesh.triangles.size());
    for (const auto& v : mesh.vertices) {
        bytes += '\xff';
        test::put(bytes, v.x(), big);
        test::put(bytes, static_cast<float>(v.y()), big);
        test::put(bytes, static_cast<float>(v.z()), big);
    }
    for (const auto& t : mesh.triangles) {
        test::put(bytes, std::uint16_t{3}, big);
        for (const int corner : t) test::put(bytes, static_cast<std::uint32_t>(corner), big);
        test::put(bytes, 0.5f, big);
    }
    return bytes + "\2\7\x8";
}

}  // namespace

TEST(PlyMesh, TextAndBothOrdersOfBytesGiveTheSameMesh) {
    const TriangleMesh tube = test::tube(2, 6, 6);
    const TriangleMesh text = parse_ply(text_ply(tube), "a.ply");
    ASSERT_EQ(text.vertices.size(), tube.vertices.size());
    EXPECT_EQ(text.triangles, tube.triangles);
    for (std::size_t i = 0; i < tube.vertices.size(); ++i)
        EXPECT_LT((text.vertices[i] - tube.vertices[i]).norm(), 1e-5);
    for (const bool big : {false, true}) {
        const TriangleMesh binary = parse_ply(binary_ply(tube, big), "a.ply");
        EXPECT_EQ(binary.triangles, text.triangles);
        ASSERT_EQ(binary.vertices.size(), tube.vertices.size());
        for (std::size_t i = 0; i < tube.vertices.size(); ++i)
            EXPECT_LT((binary.vertices[i] - tube.vertices[i]).norm(), 1e-5);
    }
}

TEST(PlyMesh, PolygonsAreCutIntoTriangles) {
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty int x\nproperty int y\nproperty int z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 2 1 0 1 2 0 0 1 0\n"
        "5 0 1 2 3 4\n2 0 1\n";
    EXPECT_EQ(parse_ply(text, "a.ply").triangles,
              (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(PlyMesh, SaysWhatIsWrongAndWhere) {
    const TriangleMesh tube = test::tube(2, 6, 6);
    const std::string text = text_ply(tube), binary = binary_ply(tube, false);
    const auto said = [](const std::string& bytes) { return refusal([&] { parse_ply(bytes, "a.ply"); }); };
    const auto wrong = [&](const std::string& file, const char* from, const char* to, const char* expected) {
        expect_said(said(test::replaced(file, from, to)), expected);
    };
    expect_said(said("ply\nformat ascii 1.0\nelement vertex 3\n"),
                "a.ply: no line 'end_header' in the first 38 bytes; expected a whole PLY file");
    expect_said(said("ply"), "no line 'end_header'");
    wrong(text, "ply\r\n", "plx\n", "a.ply:1: 'plx' was found; expected 'ply' at the start");
    wrong(text, "ascii", "asci", "a.ply:2: 'asci' was found; expected 'ascii', 'binary_little");
    wrong(text, "property double x", "property dubble x", "'dubble' was found; expected char, uchar");
    wrong(text, "property double x", "property double w", "without x, y and z");
    wrong(text, "vertex_index", "vertices", "without a list 'vertex_indices'");
    wrong(text, "list ushort", "list float", "a whole number's type for a list's length");
    wrong(text, "format", "element", "was found");
    wrong(text, "3 0 ", "3 99 ", "names corner 99; expected 0 to");
    wrong(text, "3 0 ", "1001 0 ", "a list of length 1001 in 'face' 0; expected 0 to 1000");
    wrong(text, "3 0 ", "x 0 ", "'x' was found");
    wrong(text, "255 2", "255 nan", "'nan' was found");
    wrong(binary, "element edge 1", "element edge 9", "9 of element 'edge' in the 3 bytes");
    wrong(binary, "element vertex", "element vertey", "'face' before 'vertex'");
    wrong(text, "element vertex ", "element vertex 99999999", "of element 'vertex' in the");
    for (std::size_t length = 0; length < binary.size(); length += 7)
        EXPECT_NE(said(binary.substr(0, length)), "") << length;
}

TEST(PlyMesh, StripsBecomeTriangles) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n";
    const geometry::TriangleMesh mesh = parse_ply(head + "8 0 1 2 3 -1 2 3 4\n", "strips.ply");
    const std::vector<std::array<int, 3>> expected = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
    EXPECT_EQ(mesh.triangles, expected);
    test::expect_refusal([&] { parse_ply(head + "3 0 1 5\n", "strips.ply"); },
                         "strip 0 names corner 5; expected 0 to 4, or -1 between two strips");
}

}  // namespace anatomy
