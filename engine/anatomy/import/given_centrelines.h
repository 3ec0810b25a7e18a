#pragma once
/// Centrelines supplied with a mesh.

#include <filesystem>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

/// Lines from a JSON object {"name": [[x, y, z, r], …], …} in the mesh's unit, `unit` mm long, or from a CSV
/// with the header branch,x_mm,y_mm,z_mm or branch,x_mm,y_mm,z_mm,r_mm. Radii are read but not used; they are
/// measured on the mesh. Repeated consecutive points are dropped. Throws InputError.
std::vector<geometry::Polyline> load_centrelines(const std::filesystem::path&, double unit);

}  // namespace anatomy
