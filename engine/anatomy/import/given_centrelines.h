#pragma once
/// Centrelines supplied with a mesh.

#include <filesystem>
#include <string>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

struct GivenLine {
    std::string name;           // empty = none
    geometry::Polyline points;  // [mm]
    std::vector<double> radii;  // of the points, or none; they are measured on the mesh [mm]
};

/// Lines of a file in the mesh's unit, `unit` mm long:
/// - JSON {"name": [[x, y, z, r], …], …};
/// - CSV branch,x_mm,y_mm,z_mm[,r_mm], in millimetres whatever `unit` is;
/// - VTK PolyData (.vtp, .vtk) as VMTK writes it, with radii and names or numbers of the lines where it has
///   them;
/// - a SimVascular path (.pth), named as its file.
/// Repeated consecutive points are dropped. Throws InputError.
std::vector<GivenLine> load_centrelines(const std::filesystem::path&, double unit);

}  // namespace anatomy
