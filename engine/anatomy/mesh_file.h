#pragma once
/// A mesh from a file of any format that assimp reads (STL, OBJ, PLY).

#include <filesystem>

#include "physics/geometry/vec.h"

namespace anatomy {

/// All triangles of the file in its own units; corners equal to the bit are welded. Throws InputError when
/// the file is missing, of another kind, empty, truncated, or holds numbers that are not finite; and, before
/// reading it, when it would need more than about 2 GB of memory.
geometry::TriangleMesh load_mesh(const std::filesystem::path&);

}  // namespace anatomy
