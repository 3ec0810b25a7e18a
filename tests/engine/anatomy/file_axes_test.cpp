#include "engine/anatomy/file_axes.h"

#include <fmt/format.h>
#include <random>

#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/import/lumen_import.h"
#include "engine/anatomy/mesh_file.h"
#include "engine/io/text.h"
#include "tests/engine/anatomy/mesh_texts.h"
#include "tests/engine/anatomy/tubes.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::Vec3;

template <class Line>
std::string rows(const std::vector<Line>& lines, const char* format) {
    std::string text;
    for (const Line& line : lines) text += fmt::format(fmt::runtime(format), line[0], line[1], line[2]);
    return text;
}

/// The mesh as programs write it, with their remark where such a file has one.
std::string file_of(const geometry::TriangleMesh& mesh, const std::string& kind, const std::string& remark,
                    const std::string& word) {
    const std::size_t corners = mesh.vertices.size(), faces = mesh.triangles.size();
    const std::string places = rows(mesh.vertices, "{} {} {}\n"),
                      triangles = rows(mesh.triangles, "3 {} {} {}\n");
    if (kind == "binary.stl") return test::binary_stl(mesh, remark);
    if (kind == "text.stl") {
        std::string text = "solid " + remark + "\n";
        for (const auto& t : mesh.triangles) {
            text += "facet normal 0 0 0\nouter loop\n";
            for (const int v : t) {
                const Vec3& p = mesh.vertices[static_cast<std::size_t>(v)];
                text += fmt::format("vertex {} {} {}\n", p.x(), p.y(), p.z());
            }
            text += "endloop\nendfacet\n";
        }
        return text + "endsolid\n";
    }
    if (kind == "a.obj") {
        std::vector<std::array<int, 3>> from_one = mesh.triangles;
        for (auto& t : from_one)
            for (int& v : t) ++v;
        return "# made by a test\n# " + remark + "\no a\n" + rows(mesh.vertices, "v {} {} {}\n") +
               rows(from_one, "f {} {} {}\n");
    }
    if (kind == "a.off")
        return "OFF # " + remark + "\n# " + remark + "\n" + fmt::format("{} {} 0\n", corners, faces) +
               places + triangles;
    if (kind == "a.ply")
        return fmt::format(
                   "ply\nformat ascii 1.0\ncomment {}\nelement vertex {}\nproperty float x\nproperty float "
                   "y\nproperty float z\nelement face {}\nproperty list uchar int "
                   "vertex_indices\nend_header\n",
                   remark, corners, faces) +
               places + triangles;
    if (kind == "a.vtk")
        return "# vtk DataFile Version 3.0\n" + remark + "\nASCII\nDATASET POLYDATA\n" +
               fmt::format("POINTS {} float\n", corners) + places +
               fmt::format("POLYGONS {} {}\n", faces, 4 * faces) + triangles;
    if (kind == "field.vtk")
        return "# vtk DataFile Version 3.0\nvtk output\nASCII\nDATASET POLYDATA\n" +
               (word.empty() ? "" : "FIELD FieldData 1\nSPACE 1 1 string\n" + word + "\n") +
               fmt::format("POINTS {} float\n", corners) + places +
               fmt::format("POLYGONS {} {}\n", faces, 4 * faces) + triangles;
    std::string codes, ends;
    for (const char c : word) codes += fmt::format("{} ", static_cast<int>(c));
    for (std::size_t f = 1; f <= faces; ++f) ends += fmt::format("{} ", 3 * f);
    return "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\"><PolyData>" +
           (word.empty()
                ? ""
                : "<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">" +
                      codes + "0</Array></FieldData>") +
           fmt::format(
               "<Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{}\"><Points><DataArray type=\"Float32\" "
               "NumberOfComponents=\"3\" format=\"ascii\">",
               corners, faces) +
           places +
           "</DataArray></Points><Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">" +
           rows(mesh.triangles, "{} {} {}\n") +
           "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">" + ends +
           "</DataArray></Polys></Piece></PolyData></VTKFile>";
}

const char* const kinds[] = {"binary.stl", "text.stl", "a.obj",     "a.off",
                             "a.ply",      "a.vtk",    "field.vtk", "a.vtp"};

}  // namespace

TEST(FileAxes, EveryKindOfFileIsObeyedAndNoneIsContradicted) {
    std::mt19937 random(11);
    const test::TemporaryFolder folder;
    const geometry::TriangleMesh mesh = test::tube(2, 6, 6);
    const char* const remarks[] = {"3D Slicer output. SPACE={}", "3D Slicer output. space={}", "SPACE={};",
                                   "x;Space={} y"};
    for (int trial = 0; trial < 1000; ++trial) {
        const std::string kind = kinds[random() % std::size(kinds)];
        const std::string stated = std::array{"", "LPS", "RAS", "ras", "Lps"}[random() % 5];
        const std::string given = std::array{"", "lps", "ras"}[random() % 3];
        const std::string remark =
            stated.empty() ? std::array{"", "vtk output", "COLORSPACE=RAS", "a space"}[random() % 4]
                           : fmt::format(fmt::runtime(remarks[random() % 4]), stated);
        test::write(folder / kind, file_of(mesh, kind, remark, stated));
        const StatedMesh read = load_stated_mesh(folder / kind);
        ASSERT_EQ(read.mesh.triangles.size(), mesh.triangles.size()) << kind;
        const std::string where = kind + " '" + remark + "' " + stated + " " + given;
        const std::string own = io::lower_case(stated);
        const auto take = [&] { return taken_axes(kind, read.axes, given, "--axes " + given); };
        if (!own.empty() && !given.empty() && own != given) {
            test::expect_said(test::refusal(take), "and --axes " + given + " was given; expected");
            continue;
        }
        const TakenAxes taken = take();
        EXPECT_EQ(taken.axes, !own.empty() ? own : !given.empty() ? given : "lps") << where;
        EXPECT_EQ(taken.known, !own.empty() || !given.empty()) << where;
    }
}

TEST(FileAxes, AWordThatIsNotKnownNeedsAxes) {
    const auto stated = axes_in_line("x SPACE=LAS", "the header");
    ASSERT_TRUE(stated);
    test::expect_refusal([&] { taken_axes("a.stl", stated, "", ""); },
                         "a.stl: the header says SPACE=LAS; expected LPS or RAS");
    EXPECT_EQ(taken_axes("a.stl", stated, "ras", "--axes ras").axes, "ras");
    EXPECT_EQ(axes_in_line("SPACE=left-posterior-superior", "")->axes, "lps");
    EXPECT_FALSE(axes_in_line("a COLORSPACE=RAS", ""));
}

TEST(FileAxes, ImportTurnsAMeshThatSaysRasAndTellsIt) {
    const test::TemporaryFolder folder;
    const geometry::TriangleMesh mesh = test::tube(3, 60, 24, 60);
    ImportOptions options;
    options.unit = "mm";
    const auto end_of = [&](const ImportedLumen& lumen) { return lumen.anatomy.ends[1].opening.centre; };
    test::write(folder / "plain.stl", test::binary_stl(mesh, "lumen"));
    const ImportedLumen plain = import_lumen(folder / "plain.stl", options);
    const Vec3 there = end_of(plain);
    for (const char* kind : kinds) {
        test::write(folder / kind, file_of(mesh, kind, "3D Slicer output. SPACE=RAS", "RAS"));
        const ImportedLumen turned = import_lumen(folder / kind, options);
        EXPECT_NEAR((end_of(turned) - Vec3(-there.x(), -there.y(), there.z())).norm(), 0, 0.05) << kind;
        EXPECT_EQ(turned.axes, "ras");
        test::expect_said(summary_of(turned.findings),
                          std::string(kind) + " is in RAS (+x right, +y front), ");
        ImportOptions against = options;
        against.frame.axes = "lps";
        test::expect_refusal([&] { import_lumen(folder / kind, against); }, "RAS, and --axes lps was given");
    }
    test::expect_said(summary_of(plain.findings),
                      "axes: plain.stl is in LPS (+x left, +y back), a guess, for it does not say");
}

TEST(FileAxes, CurvesOfSlicerHaveTheirOwnAxes) {
    const test::TemporaryFolder folder;
    const auto curve = [](const char* system) {
        return fmt::format(
            R"({{"markups": [{{"type": "Curve", "coordinateSystem": "{}", "coordinateUnits": "mm",
"controlPoints": [{{"position": [1, 2, 0]}}, {{"position": [0, 0, 0], "positionStatus": "undefined"}},
{{"position": [1, 2, 10]}}, {{"position": [1, 7, 20]}}],
"measurements": [{{"name": "Radius", "controlPointValues": [3.0, 9.0, 2.0, 1.0]}}]}}]}})",
            system);
    };
    test::write(folder / "aorta.mrk.json", curve("RAS"));
    const GivenLines read = load_centrelines(folder / "aorta.mrk.json", 10);
    ASSERT_EQ(read.lines.size(), 1u);
    EXPECT_EQ(read.lines[0].name, "aorta");
    ASSERT_TRUE(read.axes);
    EXPECT_EQ(read.axes->axes, "ras");
    EXPECT_EQ(read.lines[0].points.front(), Vec3(1, 2, 0));
    EXPECT_EQ(read.lines[0].points.back(), Vec3(1, 7, 20));
    EXPECT_EQ(read.lines[0].radii.front(), 3);
    EXPECT_EQ(read.lines[0].radii.back(), 1);
    EXPECT_GT(read.lines[0].points.size(), 15u);
    test::write(folder / "b.mrk.json", curve("voxel"));
    test::expect_refusal([&] { taken_axes("b", load_centrelines(folder / "b.mrk.json", 1).axes, "", ""); },
                         "its coordinateSystem is voxel; expected LPS or RAS");
    test::write(folder / "c.mrk.json", R"({"markups": [{"type": "Fiducial", "controlPoints": []}]})");
    test::expect_refusal([&] { load_centrelines(folder / "c.mrk.json", 1); },
                         "markups of type Fiducial were found, and no curve");
    for (const char* broken : {R"({"markups": 3})", R"({"markups": [3]})", R"({"markups": [{"type": 1}]})",
                               R"({"markups": [{"type": "Curve", "controlPoints": [{"position": [1, 2]}]}]})",
                               R"({"markups": [{"type": "Curve", "controlPoints": 7}]})",
                               R"({"markups": [{"type": "Curve", "coordinateUnits": "inch"}]})"}) {
        test::write(folder / "d.mrk.json", broken);
        test::expect_refusal([&] { load_centrelines(folder / "d.mrk.json", 1); }, "d.mrk.json");
    }
}

TEST(FileAxes, TablesOfVmtkBeginANewLineWhereTheyJump) {
    const test::TemporaryFolder folder;
    std::string text = "X Y Z MaximumInscribedSphereRadius\n";
    for (int i = 0; i < 40; ++i) text += fmt::format("0 0 {} 3\n", i);
    for (int i = 0; i < 40; ++i) text += fmt::format("{} 0 0 2\n", i);
    test::write(folder / "lines.dat", text);
    const GivenLines read = load_centrelines(folder / "lines.dat", 10);
    ASSERT_EQ(read.lines.size(), 2u);
    EXPECT_EQ(read.lines[1].name, "lines_2");
    EXPECT_EQ(read.lines[0].points.back(), Vec3(0, 0, 390));
    EXPECT_EQ(read.lines[1].radii.back(), 20);
    test::write(folder / "bad.dat", "X Y Z\n1 2\n");
    test::expect_refusal([&] { load_centrelines(folder / "bad.dat", 1); }, "bad.dat:2: '1 2' was found");
    test::write(folder / "head.dat", "A B C\n1 2 3\n");
    test::expect_refusal([&] { load_centrelines(folder / "head.dat", 1); }, "no columns X, Y and Z");
}

}  // namespace anatomy
