#include "engine/anatomy/mesh_file.h"

#include <algorithm>
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fmt/format.h>
#include <fstream>

#include "engine/io/error.h"
#include "physics/geometry/mesh_topology.h"

namespace anatomy {
namespace {

namespace fs = std::filesystem;

/// A triangle needs about this much memory while it is read and welded, as measured [bytes].
constexpr double bytes_per_triangle = 450;
constexpr double most_triangles = 4e6;
/// Least bytes per triangle in files of each kind.
constexpr double binary_stl = 50, text_stl = 120, other = 16;

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

/// Compares the triangle count in a binary STL's header with the file's size before anything else is read.
void check_stl(const fs::path& path, std::ifstream& stream, std::uintmax_t size) {
    const std::string head = text_at(stream, 0, 1024);
    std::uint32_t count = 0;
    if (head.size() >= 84) std::memcpy(&count, head.data() + 80, sizeof count);
    const std::uintmax_t promised = 84 + std::uintmax_t{50} * count;
    if (head.size() >= 84 && count > 0 && promised == size) {
        check_count(path, static_cast<double>(size) / binary_stl);
        return;
    }
    if (head.size() == 84 && count == 0)
        refuse(path, "a binary STL of 0 triangles was found; the surface of a lumen is accepted");
    const std::size_t word = std::min(head.find_first_not_of(" \t\r\n"), head.size());
    if (head.compare(word, 5, "solid") == 0 && head.find("facet") != std::string::npos) {
        check_count(path, static_cast<double>(size) / text_stl);
        const std::size_t tail = 1024;
        if (text_at(stream, size > tail ? size - tail : 0, tail).find("endsolid") == std::string::npos)
            refuse(path,
                   "a text STL without 'endsolid' was found: its end is missing; a whole file is accepted");
        return;
    }
    refuse(path, fmt::format(
                     "{} bytes were found where the header of a binary STL promises {} triangles, {} bytes; "
                     "a whole binary STL, or a text STL from 'solid' to 'endsolid', is accepted",
                     size, count, promised));
}

void check_before_reading(const fs::path& path) {
    std::error_code ignored;
    std::ifstream stream(path, std::ios::binary);
    if (!fs::is_regular_file(path, ignored) || !stream)
        refuse(path, "no such mesh can be read; an STL, OBJ or PLY file is accepted");
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const std::uintmax_t size = fs::file_size(path, ignored);
    if (extension == ".stl") {
        check_stl(path, stream, size);
    } else if (extension == ".obj" || extension == ".ply") {
        check_count(path, static_cast<double>(size) / (extension == ".obj" ? 2 * other : other));
        const std::string head = text_at(stream, 0, 4096);
        if (head.find('\0') != std::string::npos && extension == ".obj")
            refuse(path, "this is not text, as an OBJ file is; an STL, OBJ or PLY file is accepted");
    } else {
        refuse(path,
               fmt::format("a mesh named '{}' is not read; .stl, .obj and .ply are accepted", extension));
    }
}

}  // namespace

geometry::TriangleMesh load_mesh(const fs::path& path) {
    check_before_reading(path);
    Assimp::Importer importer;
    // Normals are not needed, and STL's would keep its corners apart: the corners are welded below.
    const aiScene* scene =
        importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
    if (!scene)
        refuse(path, fmt::format("not a readable mesh ({}); an STL, OBJ or PLY file is accepted",
                                 importer.GetErrorString()));

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
            mesh.triangles.push_back({first + static_cast<int>(face.mIndices[0]),
                                      first + static_cast<int>(face.mIndices[1]),
                                      first + static_cast<int>(face.mIndices[2])});
        }
    }
    importer.FreeScene();
    if (mesh.triangles.empty()) refuse(path, "the mesh has no triangles; a surface of triangles is accepted");
    return geometry::welded(mesh);
}

}  // namespace anatomy
