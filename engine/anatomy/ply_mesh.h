#pragma once
/// Meshes in PLY files, read by ourselves: assimp reads past the end of a file that is cut, takes indices of
/// corners that do not exist, and looks for the end of a header for ever.

#include <string>

#include "physics/geometry/vec.h"

namespace anatomy {

inline constexpr int most_corners_of_face = 1000;  // of a mesh as text, too

/// `bytes` of a whole PLY file of version 1.0, in text or binary of either order. Of the element vertex x, y
/// and z are taken, of face its list vertex_indices or vertex_index; polygons, and the strips of tristrips,
/// are cut into triangles. Throws
/// InputError "FILE: found; expected", with the line where the header or a text is at fault.
geometry::TriangleMesh parse_ply(const std::string& bytes, const std::string& file);

}  // namespace anatomy
