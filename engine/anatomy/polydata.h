#pragma once
/// Surfaces and lines of VTK's PolyData, as segmentation programs and VMTK write them: XML (.vtp) and legacy
/// (.vtk).

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

struct PolyData {
    /// One value for each point, cell or file: numbers or texts, the other is empty.
    struct Array {
        std::string name;
        std::vector<double> numbers;
        std::vector<std::string> texts;
    };
    struct Line {
        std::vector<int> points;
        int cell = 0;  // index into the arrays of cells
    };
    geometry::Polyline points;                  // in the file's unit
    std::vector<std::array<int, 3>> triangles;  // polygons and strips are cut into these
    std::vector<Line> lines;
    int cells = 0;  // of all kinds
    std::vector<Array> of_points, of_cells,
        of_file;  // radii, names and numbers of branches; no others are kept
};

/// By the file's extension. Throws InputError for a file that is missing, truncated, of another kind, or
/// inconsistent: counts, indices, numbers that are not finite, more than 4 million triangles.
PolyData load_polydata(const std::filesystem::path&);

/// Whether an array of this name holds radii: "Radius", "MaximumInscribedSphereRadius".
bool is_radius(std::string_view name);

/// The same from text; `file` is for messages.
PolyData parse_vtp(const std::string& text, const std::string& file);
PolyData parse_legacy_vtk(const std::string& text, const std::string& file);

}  // namespace anatomy
