#pragma once
/// Centrelines that come with a mesh.

#include <filesystem>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

/// Lines from a JSON object {"name": [[x, y, z, r], …], …} in the mesh's unit, `unit` mm long, or from a CSV
/// with the header branch,x_mm,y_mm,z_mm or branch,x_mm,y_mm,z_mm,r_mm. Radii are read and not used: those of
/// the mesh itself are measured. Points that repeat the one before are dropped. Throws InputError.
std::vector<geometry::Polyline> load_centrelines(const std::filesystem::path&, double unit);

}  // namespace anatomy
