#pragma once
/// Looks at a glTF file before assimp reads it, which trusts its lengths and takes nodes that hold themselves
/// for a tree.

#include <filesystem>
#include <string>

namespace anatomy {

/// Throws InputError unless the file's buffers, views, accessors, meshes and nodes fit one another, and its
/// triangles are not too many. `text` is the file: JSON, or a binary container of it (.glb).
void check_gltf(const std::string& text, const std::filesystem::path&);

}  // namespace anatomy
