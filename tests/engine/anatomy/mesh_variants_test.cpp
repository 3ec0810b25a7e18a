/// Meshes as other programs write them: each is read, read with a note, or refused.
/// `--gtest_filter=MeshVariants.*` prints the table.

#include <algorithm>
#include <cstdio>
#include <fmt/format.h>

#include "engine/anatomy/import/lumen_import.h"
#include "engine/anatomy/mesh_file.h"
#include "tests/engine/anatomy/mesh_texts.h"
#include "tests/engine/anatomy/tubes.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

constexpr double tube_length = 80, tube_bend = 90;

/// What each file is to give: a bent tube of 3 mm radius, open at both ends.
TriangleMesh bent_tube() {
    return test::tube(3, tube_length, 24, tube_bend);
}

enum class MeshOutcome { Read, Note, Refused };

int row_count = 0;

/// Imports, holds the ends against those that are wanted, and prints a row.
void expect_row(const std::filesystem::path& file, const std::string& what, MeshOutcome outcome,
                const std::string& said = {}, ImportOptions options = {}, std::size_t ends = 2) {
    SCOPED_TRACE(what);
    ++row_count;
    if (options.unit.empty()) options.unit = "mm";
    if (options.unit == "none") options.unit.clear();
    ImportedLumen lumen;
    std::string words = test::refusal([&] { lumen = import_lumen(file, options); });
    MeshOutcome found = words.empty() ? MeshOutcome::Read : MeshOutcome::Refused;
    if (found == MeshOutcome::Refused) {
        words = words.substr(0, words.find('\n'));
        if (const std::size_t place = words.find(file.filename().string() + ":"); place != std::string::npos)
            words = words.substr(words.find(": ", place) + 2);
    }
    for (const Finding& finding : lumen.findings) {
        if (finding.kind == Finding::Kind::Noted) continue;
        found = MeshOutcome::Note;
        words += (words.empty() ? "" : "; ") + finding.text;
    }
    for (const Check& check : lumen.checks) {
        if (check.verdict != Check::Verdict::Warning) continue;
        found = MeshOutcome::Note;
        words += (words.empty() ? "" : "; ") + text_of(check);
    }
    std::ranges::replace(words, '\n', ' ');
    std::printf("| %s | %s | %s |\n", what.c_str(),
                found == MeshOutcome::Read   ? "read"
                : found == MeshOutcome::Note ? "note"
                                             : "refused",
                words.c_str());
    ASSERT_EQ(static_cast<int>(found), static_cast<int>(outcome)) << words;
    if (!said.empty()) test::expect_said(words, said);
    if (found == MeshOutcome::Refused) return;
    ASSERT_EQ(lumen.anatomy.ends.size(), ends);
    const Vec3 first(0, 0, 0), last(tube_bend * std::sin(tube_length / tube_bend),
                                    tube_bend * (1 - std::cos(tube_length / tube_bend)), 0);
    for (const Vec3& end : {first, last}) {
        const double nearest = std::min((lumen.anatomy.ends[0].opening.centre - end).norm(),
                                        (lumen.anatomy.ends[1].opening.centre - end).norm());
        EXPECT_LT(nearest, 0.3) << end.transpose();
    }
    if (ends > 2) return;
    for (const VesselEnd& end : lumen.anatomy.ends) EXPECT_NEAR(end.opening.radius, 3, 0.1);
    if (outcome == MeshOutcome::Read) {
        EXPECT_EQ(lumen.anatomy.branches.size(), 1u);
    }
}

std::string obj_of(const TriangleMesh& mesh, const char* corner = " {0}", const std::string& behind = "") {
    std::string text = "# made by a test\n";
    for (const Vec3& p : mesh.vertices) text += fmt::format("v {} {} {}{}\n", p.x(), p.y(), p.z(), behind);
    text += "vt 0 0\nvn 0 0 1\n";
    const auto count = static_cast<int>(mesh.vertices.size());
    for (const auto& t : mesh.triangles) {
        text += "f";
        for (const int v : t) text += fmt::format(fmt::runtime(corner), v + 1, v - count);
        text += "\n";
    }
    return text;
}

enum class PlyForm { Text, Little, Big };

std::string ply_of(const TriangleMesh& mesh, PlyForm form, const char* number = "float", bool normals = false,
                   bool strips = false) {
    const bool big = form == PlyForm::Big;
    std::string text = fmt::format(
        "ply\nformat {} 1.0\nelement vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\n{}element {} "
        "{}\nproperty list {} int vertex_indices\nend_header\n",
        form == PlyForm::Text  ? "ascii"
        : form == PlyForm::Big ? "binary_big_endian"
                               : "binary_little_endian",
        mesh.vertices.size(), number, number, number,
        normals ? "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n" : "",
        strips ? "tristrips" : "face", strips ? 1 : mesh.triangles.size(), strips ? "int" : "uchar");
    const auto put = [&]<class Number>(Number value) {
        if (form == PlyForm::Text)
            text += fmt::format("{} ", value);
        else
            test::put(text, value, big);
    };
    for (const Vec3& p : mesh.vertices) {
        for (int k = 0; k < 3; ++k)
            if (std::string(number) == "double")
                put(p[k]);
            else
                put(static_cast<float>(p[k]));
        if (normals) put(0.0f), put(0.0f), put(1.0f), put(static_cast<std::uint8_t>(200));
        if (form == PlyForm::Text) text += "\n";
    }
    if (strips) {
        put(static_cast<std::int32_t>(4 * mesh.triangles.size()));
        for (const auto& t : mesh.triangles) {
            for (const int v : t) put(static_cast<std::int32_t>(v));
            put(std::int32_t{-1});
        }
        return text + "\n";
    }
    for (const auto& t : mesh.triangles) {
        put(static_cast<std::uint8_t>(3));
        for (const int v : t) put(static_cast<std::int32_t>(v));
        if (form == PlyForm::Text) text += "\n";
    }
    return text;
}

/// The tube of rings of quads, as an OFF file; a corner where two pairs meet, so that each is flat enough.
std::string quads_off(bool with_colours = false) {
    const int around = 24, along = 100;
    std::string text =
        fmt::format("{}OFF\n{} {} 0\n", with_colours ? "C" : "", around * (along + 1), around * along);
    for (int i = 0; i <= along; ++i)
        for (int k = 0; k < around; ++k) {
            const double angle = tube_length / tube_bend * i / along,
                         turn = 2 * std::numbers::pi * k / around;
            const Vec3 centre(tube_bend * std::sin(angle), tube_bend * (1 - std::cos(angle)), 0),
                across(-std::sin(angle), std::cos(angle), 0);
            const Vec3 p = centre + 3 * (std::cos(turn) * across + std::sin(turn) * Vec3::UnitZ());
            text += fmt::format("{} {} {}{}\n", p.x(), p.y(), p.z(), with_colours ? " 255 0 0 255" : "");
        }
    for (int i = 0; i < along; ++i)
        for (int k = 0; k < around; ++k) {
            const int n = (k + 1) % around, low = i * around, high = low + around;
            text += fmt::format("4 {} {} {} {}\n", low + k, low + n, high + n, high + k);
        }
    return text;
}

TriangleMesh scaled_tube(double factor) {
    TriangleMesh mesh = bent_tube();
    for (Vec3& v : mesh.vertices) v *= factor;
    return mesh;
}

using MeshVariants = test::InFolder;

}  // namespace

TEST_F(MeshVariants, OfFormats) {
    row_count = 0;
    const TriangleMesh mesh = bent_tube();
    PolyData data;
    data.points = mesh.vertices, data.triangles = mesh.triangles;
    const auto row = [&](const std::string& what, const std::string& name, const std::string& text,
                         MeshOutcome outcome = MeshOutcome::Read, const std::string& said = {},
                         const ImportOptions& options = {}) {
        test::write(folder / name, text);
        expect_row(folder / name, what, outcome, said, options);
    };
    const auto dos = [](const std::string& text) {
        std::string lines;
        for (const char c : text) lines += c == '\n' ? std::string("\r\n") : std::string(1, c);
        return lines;
    };
    const std::string text = test::text_stl(mesh), binary = test::binary_stl(mesh, "made by a test");
    row("STL, binary", "a.stl", binary);
    row("STL, text", "a.stl", text);
    row("STL, text, lines that end as in Windows", "a.stl", dos(text));
    row("STL, text, capitals", "a.STL", [&] {
        std::string loud = text;
        std::ranges::transform(loud, loud.begin(),
                               [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
        return loud;
    }());
    row("STL, text, two solids", "a.stl", [&] {
        const std::size_t half = text.find("\nfacet", text.size() / 2);
        return text.substr(0, half) + "\nendsolid\nsolid more" + text.substr(half);
    }());
    row("STL, binary, that begins with 'solid'", "a.stl",
        test::binary_stl(mesh, "solid exported by a program"));
    row("STL, SPACE=LPS", "a.stl", test::binary_stl(mesh, "3D Slicer output. SPACE=LPS"));
    {
        TriangleMesh turned = mesh;
        for (Vec3& v : turned.vertices) v = Vec3(-v.x(), -v.y(), v.z());
        row("STL, SPACE=RAS", "a.stl", test::binary_stl(turned, "3D Slicer output. SPACE=RAS"));
        ImportOptions ras;
        ras.frame.axes = "ras";
        row("STL, that does not say RAS, and --axes ras", "a.stl", test::binary_stl(turned, "made by a test"),
            MeshOutcome::Read, {}, ras);
        ras.frame.axes = "lps";
        row("STL, SPACE=RAS, and --axes lps", "a.stl", test::binary_stl(turned, "SPACE=RAS"),
            MeshOutcome::Refused, "SPACE=RAS, and --axes lps was given", ras);
        row("STL, SPACE=LAS", "a.stl", test::binary_stl(turned, "SPACE=LAS"), MeshOutcome::Refused,
            "expected LPS or RAS");
    }
    row("OBJ", "a.obj", obj_of(mesh));
    row("OBJ, textures and normals", "a.obj", obj_of(mesh, " {0}/1/1"));
    row("OBJ, indices from the end", "a.obj", obj_of(mesh, " {1}"));
    row("OBJ, colours of corners", "a.obj", obj_of(mesh, " {0}", " 0.5 0.1 0.1"));
    row("OBJ, Windows, a material that is not there", "a.obj",
        dos("mtllib none.mtl\nusemtl red\n" + obj_of(mesh)));
    row("PLY, text", "a.ply", ply_of(mesh, PlyForm::Text));
    row("PLY, binary", "a.ply", ply_of(mesh, PlyForm::Little));
    row("PLY, binary, big-endian", "a.ply", ply_of(mesh, PlyForm::Big));
    row("PLY, doubles", "a.ply", ply_of(mesh, PlyForm::Little, "double"));
    row("PLY, normals and colours", "a.ply", ply_of(mesh, PlyForm::Little, "float", true));
    row("PLY, strips, text", "a.ply", ply_of(mesh, PlyForm::Text, "float", false, true));
    row("PLY, strips, binary", "a.ply", ply_of(mesh, PlyForm::Little, "float", false, true));
    for (const bool is_binary : {false, true})
        for (const bool offsets : {false, true})
            row(fmt::format("VTK, legacy, {}, version {}", is_binary ? "binary" : "text",
                            offsets ? "5.1" : "3.0"),
                "a.vtk", test::legacy_vtk(data, is_binary, offsets));
    row("VTK, XML, text", "a.vtp", test::VtpText({}).of(data));
    row("VTK, XML, strips", "a.vtp", test::VtpText({}).of(data, true));
    row("VTK, XML, base64", "a.vtp", test::VtpText({.format = "binary"}).of(data));
    row("VTK, XML, appended, compressed", "a.vtp",
        test::VtpText({.format = "appended", .compressed = true, .wide = true}).of(data));
    row("VTK, XML, appended, raw, big-endian, doubles", "a.vtp",
        test::VtpText({.format = "appended", .raw = true, .big_endian = true, .doubles = true}).of(data));
    {
        TriangleMesh half = mesh;  // the file's node doubles and shifts it
        for (Vec3& v : half.vertices) v = 0.5 * (v - Vec3(1, 2, 3));
        row("glTF, with a node that moves it", "a.glb", test::glb(half));
    }
    row("OFF", "a.off", test::off(mesh));
    row("OFF, quads", "a.off", quads_off());
    row("OFF, colours of corners", "a.off", quads_off(true));

    // Units.
    ImportOptions unit;
    unit.unit = "cm";
    row("centimetres", "a.stl", test::binary_stl(scaled_tube(0.1), "made by a test"), MeshOutcome::Read, {},
        unit);
    unit.unit = "m";
    row("metres", "a.stl", test::binary_stl(scaled_tube(0.001), "made by a test"), MeshOutcome::Read, {},
        unit);
    unit.unit = "none";
    row("no unit", "a.stl", binary, MeshOutcome::Refused, "expected --unit mm, cm or m", unit);
    unit.unit = "m";
    row("millimetres said to be metres", "a.stl", binary, MeshOutcome::Refused, "is the unit right?", unit);

    // Names and damage.
    row("text STL named .obj", "a.obj", text, MeshOutcome::Refused, "not a whole obj file");
    row("OBJ named .stl", "a.stl", obj_of(mesh), MeshOutcome::Refused,
        "a text STL from 'solid' to 'endsolid'");
    row("PLY named .vtp", "a.vtp", ply_of(mesh, PlyForm::Text), MeshOutcome::Refused, "this is not XML");
    row("STEP", "a.step", "ISO-10303-21;", MeshOutcome::Refused, "a mesh named '.step' is not read");
    row("no ending", "mesh", binary, MeshOutcome::Refused, "a mesh named '' is not read");
    for (const char* name : {"e.stl", "e.obj", "e.ply", "e.off", "e.vtp", "e.vtk", "e.glb", "e.gltf"})
        row(std::string("an empty file, ") + name, name, "", MeshOutcome::Refused);
    row("STL, binary, cut off", "a.stl", binary.substr(0, binary.size() - 30), MeshOutcome::Refused,
        "expected a whole binary STL");
    row("STL, text, cut off", "a.stl", text.substr(0, text.size() / 2), MeshOutcome::Refused, "expected");
    row("OBJ, cut off in a corner", "a.obj", obj_of(mesh).substr(0, 400), MeshOutcome::Refused,
        "not a whole obj file");
    row("PLY, cut off", "a.ply", ply_of(mesh, PlyForm::Little).substr(0, 9000), MeshOutcome::Refused,
        "expected a whole PLY file");
    row("VTK, cut off", "a.vtk", test::legacy_vtk(data, true, false).substr(0, 9000), MeshOutcome::Refused,
        "expected a whole file");
    row("VTK, XML, cut off", "a.vtp", test::VtpText({}).of(data).substr(0, 9000), MeshOutcome::Refused,
        "this is not XML");
    row("glTF, cut off", "a.glb", test::glb(mesh).substr(0, 9000), MeshOutcome::Refused, "as the head says");
    row("OFF, cut off", "a.off", test::off(mesh).substr(0, 9000), MeshOutcome::Refused,
        "expected as many corners as fit");
    row("OBJ, an index beyond the corners", "a.obj", obj_of(mesh) + "f 1 2 99999\n", MeshOutcome::Refused,
        "not a whole obj file");
    row("PLY, points alone", "a.ply",
        test::replaced(ply_of(mesh, PlyForm::Text), fmt::format("element face {}", mesh.triangles.size()),
                       "element face 0"),
        MeshOutcome::Refused, "expected a surface of triangles");
    row("STL, binary, no triangles", "a.stl", test::binary_stl(TriangleMesh{}, ""), MeshOutcome::Refused,
        "a binary STL of 0 triangles");
    std::printf("%d variants\n", row_count);
    EXPECT_GE(row_count, 55);
}

TEST_F(MeshVariants, OfSurfaces) {
    row_count = 0;
    const auto row = [&](const std::string& what, const TriangleMesh& mesh, MeshOutcome outcome,
                         const std::string& said = {}, std::size_t ends = 2) {
        test::write(folder / "a.stl", test::binary_stl(mesh, "made by a test"));
        expect_row(folder / "a.stl", what, outcome, said, {}, ends);
    };
    const auto changed = [](const std::function<void(TriangleMesh&)>& change) {
        TriangleMesh mesh = bent_tube();
        change(mesh);
        return mesh;
    };
    const auto sphere = [](const Vec3& centre, double radius) {
        TriangleMesh mesh;
        const int around = 16, high = 8;
        for (int i = 0; i <= high; ++i)
            for (int k = 0; k < around; ++k) {
                const double up = std::numbers::pi * i / high, turn = 2 * std::numbers::pi * k / around;
                mesh.vertices.push_back(centre + radius * Vec3(std::sin(up) * std::cos(turn),
                                                               std::sin(up) * std::sin(turn), std::cos(up)));
            }
        for (int i = 0; i < high; ++i)
            for (int k = 0; k < around; ++k) {
                const int n = (k + 1) % around, low = i * around, top = low + around;
                if (i > 0) mesh.triangles.push_back({low + k, top + k, low + n});
                if (i + 1 < high) mesh.triangles.push_back({low + n, top + k, top + n});
            }
        return mesh;
    };
    row("open at both ends", bent_tube(), MeshOutcome::Read);
    row("flat caps at both ends",
        changed([](TriangleMesh& m) { m = geometry::capped(m, geometry::topology(m).loops); }),
        MeshOutcome::Note, "cap");
    row("turned inside out", changed([](TriangleMesh& m) {
            for (auto& t : m.triangles) std::swap(t[1], t[2]);
        }),
        MeshOutcome::Note, "turned");
    row("every third triangle turned", changed([](TriangleMesh& m) {
            for (std::size_t t = 0; t < m.triangles.size(); t += 3)
                std::swap(m.triangles[t][1], m.triangles[t][2]);
        }),
        MeshOutcome::Note, "turned");
    row("a triangle missing", changed([](TriangleMesh& m) { m.triangles.erase(m.triangles.begin() + 500); }),
        MeshOutcome::Note, "hole");
    row("twenty triangles missing", changed([](TriangleMesh& m) {
            for (int k = 0; k < 20; ++k) m.triangles.erase(m.triangles.begin() + 100 + 60 * k);
        }),
        MeshOutcome::Note, "holes");
    row("triangles twice", changed([](TriangleMesh& m) {
            for (int k = 0; k < 100; ++k) m.triangles.push_back(m.triangles[static_cast<std::size_t>(k)]);
        }),
        MeshOutcome::Note, "100 double triangles were dropped");
    row("triangles of two corners", changed([](TriangleMesh& m) {
            for (int k = 0; k < 50; ++k) m.triangles.push_back({k, k, k + 1});
        }),
        MeshOutcome::Read, "");
    row("corners that differ by rounding", changed([](TriangleMesh& m) {
            TriangleMesh soup;
            for (std::size_t t = 0; t < m.triangles.size(); ++t)
                for (const int v : m.triangles[t])
                    soup.vertices.push_back(m.vertices[static_cast<std::size_t>(v)] +
                                            Vec3::Constant(1e-6 * (t % 7)));
            for (int t = 0; t < static_cast<int>(m.triangles.size()); ++t)
                soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
            m = soup;
        }),
        MeshOutcome::Note, "weld");
    row("a fin", changed([](TriangleMesh& m) {
            m.vertices.push_back(Vec3(20, 20, 20));
            m.triangles.push_back(
                {m.triangles[600][0], m.triangles[600][1], static_cast<int>(m.vertices.size()) - 1});
        }),
        MeshOutcome::Note, "1 edges of three or more triangles");
    row("a small piece beside it",
        changed([&](TriangleMesh& m) { test::append(m, sphere(Vec3(20, 30, 0), 1)); }), MeshOutcome::Note,
        "piece");
    row("a ball that floats inside",
        changed([&](TriangleMesh& m) { test::append(m, sphere(Vec3(20, 3.4, 0), 1)); }), MeshOutcome::Note,
        "piece");
    row("two vessels", changed([](TriangleMesh& m) {
            TriangleMesh other = bent_tube();
            for (Vec3& v : other.vertices) v += Vec3(0, 0, 30);
            test::append(m, other);
        }),
        MeshOutcome::Refused, "in pieces apart, one of them 50 % of it");
    row("a vessel's wall, inner and outer surface", changed([](TriangleMesh& m) {
            TriangleMesh outer = test::tube(4, 40, 24, 60);
            test::append(m, outer);
        }),
        MeshOutcome::Refused, "the inside and the outside of a wall");
    row("a hole as wide as the vessel", changed([](TriangleMesh& m) {
            std::erase_if(m.triangles, [&](const auto& t) {
                return (m.vertices[static_cast<std::size_t>(t[0])] - Vec3(20, 3.4, 3)).norm() < 2.5;
            });
        }),
        MeshOutcome::Read, "", 3);
    row("a cap at one end", changed([](TriangleMesh& m) {
            auto loops = geometry::topology(m).loops;
            loops.resize(1);
            m = geometry::capped(m, loops);
        }),
        MeshOutcome::Note, "cap");
    row("a slit along the vessel", changed([](TriangleMesh& m) {
            std::erase_if(m.triangles, [&](const auto& t) {
                return std::ranges::all_of(t, [&](int v) {
                    const Vec3& p = m.vertices[static_cast<std::size_t>(v)];
                    return p.z() > 2.6 && p.x() > 5 && p.x() < 60;
                });
            });
        }),
        MeshOutcome::Refused, "expected a lumen that a wire can pass");
    row("a closed ball", sphere(Vec3(0, 0, 0), 10), MeshOutcome::Refused, "a ball, not a vessel");
    row("a flat sheet", {{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {10, 10, 0}}, {{0, 1, 2}, {1, 3, 2}}},
        MeshOutcome::Refused, "2 triangles were found");
    row("one triangle", {{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}}, {{0, 1, 2}}}, MeshOutcome::Refused,
        "1 triangle was found");
    row("a corner of NaN", changed([](TriangleMesh& m) { m.vertices[40].y() = std::nan(""); }),
        MeshOutcome::Refused, "is not a finite number");
    row("an infinite corner", changed([](TriangleMesh& m) { m.vertices[40].y() = INFINITY; }),
        MeshOutcome::Refused, "is not a finite number");
    row("coordinates of kilometres", scaled_tube(1e6), MeshOutcome::Refused,
        "expected coordinates up to 10000 mm");
    row("a corner that stands out", changed([](TriangleMesh& m) { m.vertices[700] += Vec3(0, 0, 200); }),
        MeshOutcome::Note, "stands out");
    row("one corner far away", changed([](TriangleMesh& m) { m.vertices[700] = Vec3(5000, 0, 0); }),
        MeshOutcome::Refused, "expected up to 2500");
    row("a vessel of 0.1 mm", scaled_tube(0.02), MeshOutcome::Refused, "expected 0.2 to 20 mm");
    std::printf("%d variants\n", row_count);
    EXPECT_GE(row_count, 25);
}

}  // namespace anatomy
