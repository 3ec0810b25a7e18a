#include "engine/anatomy/mesh_file.h"

#include <algorithm>
#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fmt/format.h>
#include <fstream>
#include <string>

#include "engine/anatomy/gltf_check.h"
#include "engine/anatomy/ply_mesh.h"
#include "engine/anatomy/polydata.h"
#include "engine/anatomy/text_scanner.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/vec.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

// Text is read by ourselves so that an error names its line: assimp takes half a number for a whole one, and
// the nearest corner for one that does not exist.

double coordinate(TextScanner& words, std::string_view what) {
    const double number = words.number(what);
    if (std::abs(number) > 1e30) words.refuse("a number up to 1e30");
    return static_cast<float>(number);
}
Vec3 corner(TextScanner& words) {
    const double x = coordinate(words, "x of a corner"), y = coordinate(words, "y of a corner");
    return {x, y, coordinate(words, "z of a corner")};
}

void expect(TextScanner& words, std::string_view word, std::string_view where) {
    if (words.take(word)) return;
    words.word();
    words.refuse(fmt::format("'{}' {}", word, where));
}

/// Throws InputError "FILE:LINE: found; accepted". Coordinates are of single precision, as those of a binary
/// file are.
TriangleMesh parse_text_stl(const std::string& text, const std::string& file) {
    TextScanner words(text, file);
    TriangleMesh mesh;
    expect(words, "solid", "at the start of a text STL");
    while (true) {
        words.rest_of_line();  // the solid's name
        while (words.take("facet")) {
            words.rest_of_line();  // a normal, which follows from the corners
            expect(words, "outer", "behind the normal of a facet");
            expect(words, "loop", "behind 'outer'");
            const int first = static_cast<int>(mesh.vertices.size());
            for (int k = 0; k < 3; ++k) {
                expect(words, "vertex", fmt::format("{} of 3 of a facet", k + 1));
                mesh.vertices.push_back(corner(words));
            }
            expect(words, "endloop", "behind three vertices");
            expect(words, "endfacet", "behind 'endloop'");
            mesh.triangles.push_back({first, first + 1, first + 2});
        }
        expect(words, "endsolid", "or 'facet' behind a facet");
        words.rest_of_line();
        if (words.at_end()) return mesh;
        expect(words, "solid", "or the end of the file behind 'endsolid'");
    }
}

/// Also with colours or normals (COFF, NOFF, CNOFF). Polygons are cut into triangles.
TriangleMesh parse_off(const std::string& text, const std::string& file) {
    TextScanner words(text, file);
    words.comments = true;
    const bool plain = words.take("OFF");
    if (!plain && !words.take("COFF") && !words.take("NOFF") && !words.take("CNOFF")) {
        words.word();
        words.refuse("'OFF', 'COFF', 'NOFF' or 'CNOFF' at the start of the file");
    }
    // A line of an OFF file has 6 bytes at least for a corner and 8 for a triangle.
    const auto corners =
        words.whole("the number of corners", 3, static_cast<std::int64_t>(3 * most_triangles));
    if (static_cast<std::size_t>(6 * corners) > words.left())
        words.refuse(fmt::format("as many corners as fit in the {} bytes that are left", words.left()));
    const auto faces = words.whole("the number of faces", 1, static_cast<std::int64_t>(most_triangles));
    if (static_cast<std::size_t>(8 * faces) > words.left())
        words.refuse(fmt::format("as many faces as fit in the {} bytes that are left", words.left()));
    words.whole("the number of edges, which may be 0", 0, std::int64_t{1} << 40);
    TriangleMesh mesh;
    for (std::int64_t i = 0; i < corners; ++i) {
        mesh.vertices.push_back(corner(words));
        if (!plain) words.rest_of_line();
    }
    const auto index = [&] { return static_cast<int>(words.whole("a corner's index", 0, corners - 1)); };
    for (std::int64_t i = 0; i < faces; ++i) {
        const auto count = words.whole("the number of a face's corners", 1, 1000);
        const int first = index();
        int before = count > 1 ? index() : first;
        for (std::int64_t k = 2; k < count; ++k) {
            const int next = index();
            mesh.triangles.push_back({first, before, next});
            before = next;
        }
        words.rest_of_line();  // a colour
        if (static_cast<double>(mesh.triangles.size()) > most_triangles)
            words.refuse(fmt::format("up to {:.0f} million triangles", most_triangles / 1e6));
    }
    return mesh;
}

namespace fs = std::filesystem;

/// A triangle needs about this much memory while it is read and welded, as measured [bytes].
constexpr double bytes_per_triangle = 450;
/// Least bytes per triangle in files of each kind; for PLY, whose header has the counts, most.
constexpr double binary_stl = 50, text_stl = 100, off = 8, gltf = 6, obj = 32, ply = 100;
constexpr const char* kinds = "an STL, OBJ, PLY, OFF, VTP, VTK, GLB or glTF file is accepted";

[[noreturn]] void refuse(const fs::path& path, const std::string& found) {
    throw io::InputError(path.string() + ": " + found);
}

void check_count(const fs::path& path, double triangles) {
    if (triangles <= most_triangles) return;
    refuse(path,
           fmt::format("up to {:.3g} million triangles would need {:.1f} GB of memory; {:.0f} million are "
                       "accepted: make the mesh coarser in a mesh editor",
                       triangles / 1e6, triangles * bytes_per_triangle / 1e9, most_triangles / 1e6));
}

std::string text_at(std::ifstream& stream, std::uintmax_t from, std::size_t count) {
    std::string text(count, '\0');
    stream.clear();
    stream.seekg(static_cast<std::streamoff>(from));
    stream.read(text.data(), static_cast<std::streamsize>(count));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    return text;
}

/// Whether this is a text STL. A binary one's triangle count is compared with the file's size before anything
/// else is read.
bool is_text_stl(const fs::path& path, std::ifstream& stream, std::uintmax_t size) {
    const std::string head = text_at(stream, 0, 1024);
    std::uint32_t count = 0;
    if (head.size() >= 84) std::memcpy(&count, head.data() + 80, sizeof count);
    const std::uintmax_t promised = 84 + std::uintmax_t{50} * count;
    if (head.size() >= 84 && count > 0 && promised == size) {
        check_count(path, static_cast<double>(size) / binary_stl);
        return false;
    }
    if (head.size() == 84 && count == 0)
        refuse(path, "a binary STL of 0 triangles was found; the surface of a lumen is accepted");
    const std::size_t word = std::min(head.find_first_not_of(" \t\r\n"), head.size());
    if (same_word(std::string_view(head).substr(word, 5), "solid") && head.find('\0') == std::string::npos) {
        check_count(path, static_cast<double>(size) / text_stl);
        return true;
    }
    refuse(path, fmt::format(
                     "{} bytes were found where the header of a binary STL promises {} triangles, {} bytes; "
                     "a whole binary STL, or a text STL from 'solid' to 'endsolid', is accepted",
                     size, count, promised));
}

geometry::TriangleMesh from_polydata(const fs::path& path) {
    PolyData data = load_polydata(path);
    if (data.triangles.empty())
        refuse(path, fmt::format("it has {} points and {} lines, but no triangles; the surface of a lumen is "
                                 "accepted{}",
                                 data.points.size(), data.lines.size(),
                                 data.lines.empty() ? "" : ", and lines by --centrelines"));
    return {std::move(data.points), std::move(data.triangles)};
}

/// Opens regular files alone: a mesh may name others, such as materials.
class RegularFiles final : public Assimp::DefaultIOSystem {
public:
    Assimp::IOStream* Open(const char* file, const char* mode) override {
        std::error_code ignored;
        return fs::is_regular_file(file, ignored) ? DefaultIOSystem::Open(file, mode) : nullptr;
    }
};

// Normals are not needed, and STL's would keep its corners apart: the corners are welded below. Nodes of a
// glTF file place its meshes; what they scale is left to the unit that the user gives.
constexpr unsigned as_triangles = aiProcess_Triangulate | aiProcess_PreTransformVertices;

geometry::TriangleMesh taken(const aiScene* scene, const fs::path& path) {
    // The library's own words speak of its insides.
    if (!scene) refuse(path, fmt::format("not a whole {} file; {}", extension_of(path).substr(1), kinds));

    geometry::TriangleMesh mesh;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const aiMesh& part = *scene->mMeshes[m];
        const int first = static_cast<int>(mesh.vertices.size());
        for (unsigned v = 0; v < part.mNumVertices; ++v) {
            mesh.vertices.emplace_back(part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z);
            if (!mesh.vertices.back().allFinite())
                refuse(path, fmt::format("corner {} is not a finite number; finite numbers are accepted", v));
        }
        for (unsigned f = 0; f < part.mNumFaces; ++f) {
            const aiFace& face = part.mFaces[f];
            if (face.mNumIndices != 3) continue;  // points and lines
            for (unsigned k = 0; k < 3; ++k)
                if (face.mIndices[k] >= part.mNumVertices)
                    refuse(path, fmt::format("face {} names corner {}; 0 to {} is accepted", f,
                                             face.mIndices[k], static_cast<int>(part.mNumVertices) - 1));
            mesh.triangles.push_back({first + static_cast<int>(face.mIndices[0]),
                                      first + static_cast<int>(face.mIndices[1]),
                                      first + static_cast<int>(face.mIndices[2])});
        }
    }
    return mesh;
}

geometry::TriangleMesh by_assimp(const fs::path& path) {
    Assimp::Importer importer;
    importer.SetIOHandler(new RegularFiles);  // which the importer deletes
    return taken(importer.ReadFile(path.string(), as_triangles), path);
}

/// Assimp's time for a face, or a line, grows with the square of its corners. A backslash at the end of a
/// line continues it.
void check_obj_faces(std::string_view text, const fs::path& path) {
    constexpr std::string_view blank = " \t\r\f\v";
    int line = 1, first_line = 0, words = 0;
    bool in_word = false, continues = false;
    char kind = 0;  // first letter of the line
    for (const char c : text) {
        if (c == '\n') {
            ++line;
            in_word = false;
            if (!std::exchange(continues, false)) words = kind = 0;
        } else if (blank.find(c) != std::string_view::npos) {
            in_word = false;
        } else {
            continues = c == '\\';
            if (std::exchange(in_word, true)) continue;
            if (words++ == 0) kind = c, first_line = line;
            if (words > most_corners_of_face + 1 && (kind == 'f' || kind == 'l' || kind == 'p'))
                refuse(path, fmt::format("line {}: found more than {} corners, expected a face of at most so "
                                         "many; a mesh editor makes triangles of it",
                                         first_line, most_corners_of_face));
        }
    }
}

geometry::TriangleMesh joined(const geometry::TriangleMesh& mesh, const fs::path& path) {
    if (mesh.triangles.empty()) refuse(path, "the mesh has no triangles; a surface of triangles is accepted");
    return geometry::welded(mesh);
}

geometry::TriangleMesh read_by_kind(const fs::path& path) {
    std::error_code ignored;
    std::ifstream stream = io::open_to_read(path, "mesh", kinds);
    const std::string extension = extension_of(path);
    const std::uintmax_t size = fs::file_size(path, ignored);
    const auto whole_text = [&](double least_per_triangle) {
        check_count(path, static_cast<double>(size) / least_per_triangle);
        return io::read_text(path, "mesh", kinds);
    };
    if (extension == ".vtp" || extension == ".vtk") return from_polydata(path);
    if (extension == ".ply") return parse_ply(whole_text(ply), path.string());
    if (extension == ".off") return parse_off(whole_text(off), path.string());
    if (extension == ".stl") {
        if (is_text_stl(path, stream, size)) return parse_text_stl(whole_text(text_stl), path.string());
    } else if (extension == ".glb" || extension == ".gltf") {
        check_gltf(whole_text(gltf), path);
    } else if (extension == ".obj") {
        check_count(path, static_cast<double>(size) / obj);
        if (text_at(stream, 0, 4096).find('\0') != std::string::npos)
            refuse(path, fmt::format("this is not text, as an OBJ file is; {}", kinds));
        check_obj_faces(io::read_text(path, "mesh", kinds), path);
    } else {
        refuse(path, fmt::format("a mesh named '{}' is not read; {}", extension, kinds));
    }
    return by_assimp(path);
}

}  // namespace

geometry::TriangleMesh load_mesh(const fs::path& path) {
    return joined(read_by_kind(path), path);
}

geometry::TriangleMesh parse_stl(const std::string& bytes, const std::string& name) {
    Assimp::Importer importer;
    return joined(
        taken(importer.ReadFileFromMemory(bytes.data(), bytes.size(), as_triangles, "stl"), name + ".stl"),
        name);
}

}  // namespace anatomy
