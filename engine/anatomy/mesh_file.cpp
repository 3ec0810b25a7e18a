#include "engine/anatomy/mesh_file.h"

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <fstream>

#include "engine/anatomy/mesh_topology.h"
#include "engine/error.h"

namespace engine {

physics::TriangleMesh load_mesh(const std::filesystem::path& path) {
    const std::string file = path.string();
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored) || !std::ifstream(path)) {
        throw InputError(file + ": no such mesh can be read; an STL, OBJ or PLY file is accepted");
    }
    Assimp::Importer importer;
    // Meshes carry no normals that we need, and STL's would keep its corners apart: weld them ourselves.
    const aiScene* scene = importer.ReadFile(file, aiProcess_Triangulate | aiProcess_PreTransformVertices);
    if (!scene)
        throw InputError(fmt::format("{}: not a readable mesh ({})", file, importer.GetErrorString()));

    physics::TriangleMesh mesh;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const aiMesh& part = *scene->mMeshes[m];
        const int first = static_cast<int>(mesh.vertices.size());
        for (unsigned v = 0; v < part.mNumVertices; ++v) {
            mesh.vertices.emplace_back(part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z);
            if (!mesh.vertices.back().allFinite()) {
                throw InputError(fmt::format("{}: corner {} is not a finite number", file, v));
            }
        }
        for (unsigned f = 0; f < part.mNumFaces; ++f) {
            const aiFace& face = part.mFaces[f];
            if (face.mNumIndices != 3) continue;  // points and lines
            mesh.triangles.push_back({first + static_cast<int>(face.mIndices[0]),
                                      first + static_cast<int>(face.mIndices[1]),
                                      first + static_cast<int>(face.mIndices[2])});
        }
    }
    if (mesh.triangles.empty()) throw InputError(file + ": the mesh has no triangles");
    return welded(mesh);
}

}  // namespace engine
