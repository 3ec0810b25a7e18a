#pragma once
/// Centrelines supplied with a mesh.

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/file_axes.h"
#include "physics/geometry/vec.h"

namespace anatomy {

struct GivenLine {
    std::string name;           // empty = none
    geometry::Polyline points;  // [mm]
    std::vector<double> radii;  // of the points, or none; they are measured on the mesh [mm]
    void state(geometry::StateStream& s) { s(name, points, radii); }
};

struct GivenLines {
    std::vector<GivenLine> lines;
    std::optional<StatedAxes> axes;  // by the file's own word
};

/// Lines of a file in the mesh's unit, `unit` mm long:
/// - JSON {"name": [[x, y, z, r], …], …};
/// - CSV branch,x_mm,y_mm,z_mm[,r_mm], in millimetres whatever `unit` is;
/// - VTK PolyData (.vtp, .vtk) as VMTK writes it, with radii and names or numbers of the lines where it has
///   them;
/// - a SimVascular path (.pth), named as its file;
/// - curves and lines of 3D Slicer (.mrk.json), in millimetres: smooth through their control points, with the
///   measurement Radius where they have it, named as the file where they have no name;
/// - a table of VMTK (.dat) with X, Y, Z and, maybe, radii: a new line begins where a point lies far from the
///   one before, named as the file and numbered.
/// Repeated consecutive points are dropped. Throws InputError. The file is read behind a wall (io/wall.h).
GivenLines load_centrelines(const std::filesystem::path&, double unit);

/// Points of 3D Slicer (.mrk.json, Fiducial), by their labels, in millimetres.
struct GivenPlaces {
    std::vector<std::pair<std::string, geometry::Vec3>> places;
    std::optional<StatedAxes> axes;
};
/// Throws InputError.
GivenPlaces load_places(const std::filesystem::path&);

}  // namespace anatomy
