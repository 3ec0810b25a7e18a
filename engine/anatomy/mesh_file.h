#pragma once
/// A mesh from a file: STL, OBJ, PLY, OFF, VTK's PolyData (.vtp, .vtk), glTF (.glb, .gltf).

#include <filesystem>
#include <optional>

#include "engine/anatomy/file_axes.h"
#include "physics/geometry/vec.h"

namespace anatomy {

/// A mesh of more is refused: it would need about 2 GB of memory.
inline constexpr double most_triangles = 4e6;

/// Coordinates beyond this are no patient's, and beyond what the search for triangles can take [mm].
inline constexpr double largest_coordinate = 1e4;

/// All triangles of the file in its own units; corners equal to the bit are welded. Throws InputError when
/// the file is missing, of another kind, empty, truncated, inconsistent, or holds numbers that are not
/// finite. The file is read behind a wall (io/wall.h).
geometry::TriangleMesh load_mesh(const std::filesystem::path&);

/// The mesh of a file, in the file's own axes, and what it states of them: in the header of an STL, a comment
/// of OBJ, PLY or OFF, the title of a legacy VTK file, a field named SPACE of either kind of PolyData.
struct StatedMesh {
    geometry::TriangleMesh mesh;
    std::optional<StatedAxes> axes;
};
StatedMesh load_stated_mesh(const std::filesystem::path&);

/// The same from the bytes of a binary STL.
geometry::TriangleMesh parse_stl(const std::string& bytes, const std::string& name);

}  // namespace anatomy
