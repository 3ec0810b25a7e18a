#pragma once
/// Meshes written as text, read by ourselves so that an error names its line: assimp takes half a number for
/// a whole one, and the nearest corner for one that does not exist.

#include <string>

#include "physics/geometry/vec.h"

namespace anatomy {

/// Throws InputError "FILE:LINE: found; accepted". Coordinates are of single precision, as those of a binary
/// file are.
geometry::TriangleMesh parse_text_stl(const std::string& text, const std::string& file);
/// Also with colours or normals (COFF, NOFF, CNOFF). Polygons are cut into triangles.
geometry::TriangleMesh parse_off(const std::string& text, const std::string& file);

}  // namespace anatomy
