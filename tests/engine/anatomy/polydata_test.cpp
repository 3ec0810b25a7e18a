#include "engine/anatomy/polydata.h"

#include <random>

#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/mesh_file.h"
#include "engine/io/wall.h"
#include "tests/engine/anatomy/mesh_texts.h"
#include "tests/engine/anatomy/tubes.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using test::refusal, test::TemporaryFolder, test::write, test::VtpStyle, test::VtpText, test::expect_said;

/// A tube with two named lines in it, whose points have radii.
PolyData small_polydata() {
    const geometry::TriangleMesh mesh = test::tube(2, 12, 8);
    PolyData data;
    data.points = mesh.vertices;
    data.triangles = mesh.triangles;
    for (const double y : {0.0, 0.5}) {
        PolyData::Line line;
        for (int i = 0; i < 5; ++i) {
            line.points.push_back(static_cast<int>(data.points.size()));
            data.points.emplace_back(3.0 * i, y, 0);
        }
        line.cell = static_cast<int>(data.lines.size());
        data.lines.push_back(line);
    }
    data.cells = 2 + static_cast<int>(data.triangles.size());
    PolyData::Array radius{"MaximumInscribedSphereRadius", {}, {}}, name{"Name", {}, {}};
    for (std::size_t i = 0; i < data.points.size(); ++i)
        radius.numbers.push_back(2 - 0.001 * static_cast<double>(i));
    for (int i = 0; i < data.cells; ++i) name.texts.push_back(i == 0 ? "LCCA" : i == 1 ? "LICA" : "wall");
    data.of_points = {radius};
    data.of_cells = {name};
    return data;
}

void expect_same(const PolyData& read, const PolyData& truth) {
    ASSERT_EQ(read.points.size(), truth.points.size());
    for (std::size_t i = 0; i < truth.points.size(); ++i)
        EXPECT_LT((read.points[i] - truth.points[i]).norm(), 1e-5) << i;
    EXPECT_EQ(read.triangles, truth.triangles);
    ASSERT_EQ(read.lines.size(), truth.lines.size());
    for (std::size_t i = 0; i < truth.lines.size(); ++i) {
        EXPECT_EQ(read.lines[i].points, truth.lines[i].points);
        EXPECT_EQ(read.lines[i].cell, truth.lines[i].cell);
    }
    EXPECT_EQ(read.cells, truth.cells);
    ASSERT_EQ(read.of_points.size(), 1u);
    EXPECT_EQ(read.of_points[0].name, truth.of_points[0].name);
    EXPECT_EQ(read.of_points[0].numbers, truth.of_points[0].numbers);
    ASSERT_EQ(read.of_cells.size(), 1u);
    EXPECT_EQ(read.of_cells[0].texts, truth.of_cells[0].texts);
}

std::vector<VtpStyle> all_styles() {
    std::vector<VtpStyle> styles = {{}};
    for (const bool compressed : {false, true})
        for (const bool wide : {false, true})
            for (const bool big : {false, true}) {
                styles.push_back({"binary", false, compressed, wide, big, wide, big});
                for (const bool raw : {false, true})
                    styles.push_back({"appended", raw, compressed, wide, big, big, wide});
            }
    return styles;
}

}  // namespace

TEST(PolyData, VtpIsReadInEveryEncoding) {
    const PolyData truth = small_polydata();
    for (const VtpStyle& style : all_styles()) {
        SCOPED_TRACE(fmt::format("{} raw {} compressed {} wide {} big {}", style.format, style.raw,
                                 style.compressed, style.wide, style.big_endian));
        expect_same(parse_vtp(VtpText(style).of(truth), "a.vtp"), truth);
    }
}

TEST(PolyData, LegacyVtkIsReadInEveryLayout) {
    const PolyData truth = small_polydata();
    for (const bool binary : {false, true})
        for (const bool offsets : {false, true}) {
            SCOPED_TRACE(fmt::format("binary {} offsets {}", binary, offsets));
            expect_same(parse_legacy_vtk(test::legacy_vtk(truth, binary, offsets), "a.vtk"), truth);
        }
}

TEST(PolyData, PolygonsAndStripsAreCutIntoTrianglesOfOneSide) {
    const std::string text =
        "# vtk DataFile Version 2.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 6 float\n"
        "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 1 2 0\nPOLYGONS 1 5\n4 0 1 3 2\nTRIANGLE_STRIPS 1 7\n6 0 1 2 3 4 5\n";
    const PolyData data = parse_legacy_vtk(text, "a.vtk");
    ASSERT_EQ(data.triangles.size(), 6u);
    for (const auto& t : data.triangles) {
        const geometry::Vec3 &a = data.points[t[0]], &b = data.points[t[1]], &c = data.points[t[2]];
        EXPECT_GT((b - a).cross(c - a).z(), 0);
    }
}

TEST(PolyData, PiecesAreJoined) {
    const std::string piece =
        "<Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><Points><DataArray type=\"Float32\" "
        "format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points><Polys><DataArray type=\"Int32\" "
        "Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray><DataArray type=\"Int32\" "
        "Name=\"offsets\" format=\"ascii\">3</DataArray></Polys></Piece>";
    const PolyData data =
        parse_vtp("<VTKFile type=\"PolyData\"><PolyData>" + piece + piece + "</PolyData></VTKFile>", "a.vtp");
    EXPECT_EQ(data.points.size(), 6u);
    ASSERT_EQ(data.triangles.size(), 2u);
    EXPECT_EQ(data.triangles[1], (std::array<int, 3>{3, 4, 5}));
}

TEST(PolyData, WhatIsWrongIsNamedWithItsPlace) {
    const auto vtp = [](const std::string& from, const std::string& to) {
        const std::string text = test::replaced(VtpText({}).of(small_polydata()), from, to);
        return refusal([&] { parse_vtp(text, "a.vtp"); });
    };
    expect_said(vtp("</Points>", "</Pints>"), "a.vtp:19: this is not XML");
    expect_said(vtp("NumberOfLines=\"2\"", "NumberOfLines=\"3\""), "<Lines>: 2 cells were found; expected 3");
    expect_said(vtp("NumberOfPoints=\"82\"", "NumberOfPoints=\"83\""),
                "246 numbers were found; expected 249");
    expect_said(vtp("<PolyData>", "<UnstructuredGrid>"), "this is not XML");
    expect_said(vtp("Name=\"offsets\" NumberOfComponents=\"1\" format=\"ascii\">\n5 ",
                    "Name=\"offsets\" format=\"ascii\">\n11 "),
                "a cell goes from index 0 to 11");
    expect_said(vtp(">\n72 73", ">\n82 73"), "Lines: index 0 is 82; expected 0 to 81");
    expect_said(vtp(">\n72 73", ">\nx72 73"), "a.vtp:22: 'x72' was found");
    expect_said(vtp("Float32", "Float16"), "type 'Float16' was found");
    test::expect_refusal([] { parse_vtp("<VTKFile type=\"ImageData\"><ImageData/></VTKFile>", "a.vtp"); },
                         "type 'ImageData' was found; expected type 'PolyData'");
    const auto vtk = [](const std::string& text) {
        return refusal([&] { parse_legacy_vtk("# vtk DataFile Version 3.0\nx\n" + text, "a.vtk"); });
    };
    expect_said(vtk("ASCII\nDATASET STRUCTURED_GRID\n"),
                "a.vtk:4: 'STRUCTURED_GRID' was found; expected POLYDATA");
    expect_said(vtk("ASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3\n4 5 nan\n"), "a.vtk:7: 'nan' was found");
    expect_said(vtk("BINARY\nDATASET POLYDATA\nPOINTS 900000 float\n1 2 3\n"),
                "the end of the file 6 bytes into a coordinate");
}

TEST(PolyData, PackedZerosTakeNoMoreMemoryThanTheFileMay) {
    // A gigabyte of zeros packs to a megabyte: the array says more than its points have.
    std::string packed(1 << 20, '\0');
    uLongf size = packed.size();
    const std::string zeros(std::size_t{1} << 28, '\0');
    ASSERT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size,
                       reinterpret_cast<const Bytef*>(zeros.data()), zeros.size()),
              Z_OK);
    std::string head;
    for (const std::uint32_t n : {1u, 1u << 28, 0u, static_cast<std::uint32_t>(size)}) test::put(head, n);
    const std::string text =
        "<VTKFile type=\"PolyData\" compressor=\"vtkZLibDataCompressor\"><PolyData><Piece "
        "NumberOfPoints=\"9\">"
        "<Points><DataArray type=\"Float32\" format=\"binary\">" +
        test::base64(head) + test::base64(packed.substr(0, size)) +
        "</DataArray></Points></Piece></PolyData></VTKFile>";
    test::expect_refusal([&] { parse_vtp(text, "a.vtp"); },
                         "an array of 268435456 bytes was found; expected at most 108");
}

using MeshFile = test::InFolder;

TEST_F(MeshFile, ATubeIsTheSameInEveryFormat) {
    const geometry::TriangleMesh tube = test::tube(2, 12, 8);
    PolyData data;
    data.points = tube.vertices;
    data.triangles = tube.triangles;
    write(folder / "a.vtp", VtpText({"appended", true, true}).of(data));
    write(folder / "a.vtk", test::legacy_vtk(data, true, true));
    write(folder / "a.off", test::off(tube));
    write(folder / "a.STL", test::text_stl(tube));
    write(folder / "a.glb", test::glb(tube));
    for (const char* name : {"a.vtp", "a.vtk", "a.off", "a.STL", "a.glb"}) {
        SCOPED_TRACE(name);
        const geometry::TriangleMesh read = load_mesh(folder / name);
        ASSERT_EQ(read.triangles.size(), tube.triangles.size());
        EXPECT_EQ(read.vertices.size(), tube.vertices.size());
        const bool placed = std::string(name) == "a.glb";
        for (std::size_t t = 0; t < tube.triangles.size(); ++t)
            for (int k = 0; k < 3; ++k) {
                geometry::Vec3 corner = tube.vertices[tube.triangles[t][k]];
                if (placed) corner = 2 * corner + geometry::Vec3(1, 2, 3);
                EXPECT_LT((read.vertices[read.triangles[t][k]] - corner).norm(), 1e-5);
            }
    }
}

/// Whole files with bytes changed, cut off, doubled: each is read or refused.
TEST_F(MeshFile, DamagedFilesAreReadOrRefused) {
    const io::WithoutWall here;
    const geometry::TriangleMesh tube = test::tube(2, 6, 6);
    PolyData data = small_polydata();
    std::vector<std::pair<std::string, std::string>> whole;
    for (const VtpStyle& style :
         {VtpStyle{}, VtpStyle{"binary", false, true}, VtpStyle{"appended", true, true, true},
          VtpStyle{"appended", false, false}, VtpStyle{"appended", true, false, false, true}})
        whole.emplace_back("a.vtp", VtpText(style).of(data));
    for (const bool binary : {false, true})
        for (const bool offsets : {false, true})
            whole.emplace_back("a.vtk", test::legacy_vtk(data, binary, offsets));
    whole.emplace_back("a.off", test::off(tube));
    whole.emplace_back("a.stl", test::text_stl(tube));
    whole.emplace_back("a.glb", test::glb(tube));
    whole.emplace_back(
        "a.pth",
        "<?xml version=\"1.0\"?>\n<path id=\"1\"><timestep id=\"0\"><path_element><path_points>"
        "<path_point id=\"0\"><pos x=\"1\" y=\"2\" z=\"3\"/></path_point><path_point id=\"1\">"
        "<pos x=\"2\" y=\"2\" z=\"3\"/></path_point></path_points></path_element></timestep></path>");
    int read = 0, refused = 0;
    for (std::uint32_t seed = 0; seed < 3000; ++seed) {
        std::mt19937 random(seed);
        auto [name, text] = whole[seed % whole.size()];
        const auto at = [&](std::size_t size) { return random() % std::max<std::size_t>(size, 1); };
        const auto changes = 1 + random() % 3;
        for (std::uint32_t k = 0; k < changes; ++k) {
            const auto kind = random() % 5;
            // Heads decide most: every other change is made in the first kilobyte.
            const std::size_t place =
                at(random() % 2 ? std::min<std::size_t>(text.size(), 1024) : text.size());
            if (text.empty()) break;
            if (kind == 0) text.resize(place);
            if (kind == 1) text[place] = static_cast<char>(random());
            if (kind == 2) text[place] = "0123456789-.e<>\"{}[] \n"[at(22)];
            if (kind == 3) text.erase(place, at(40));
            if (kind == 4) text.insert(place, text.substr(at(text.size()), at(60)));
        }
        write(folder / name, text);
        for (const bool lines : {false, true}) {
            if (!lines && name == "a.pth") continue;
            if (lines && (name == "a.off" || name == "a.stl" || name == "a.glb")) continue;
            try {
                if (lines)
                    load_centrelines(folder / name, 1);
                else
                    load_mesh(folder / name);
                ++read;
            } catch (const io::InputError& error) {
                ++refused;
                EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << seed << error.what();
            } catch (const std::exception& error) {
                ADD_FAILURE() << "seed " << seed << ", " << name << ": " << error.what();
            }
        }
    }
    std::printf("seeds 0 to 2999: %d read, %d refused\n", read, refused);
    EXPECT_GT(read, 300);
    EXPECT_GT(refused, 1000);
}

}  // namespace anatomy
