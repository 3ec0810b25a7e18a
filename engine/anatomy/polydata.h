#pragma once
/// Surfaces and lines of VTK's PolyData, as segmentation programs and VMTK write them: XML (.vtp) and legacy
/// (.vtk).

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/file_axes.h"
#include "engine/io/number_type.h"
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
        of_file;                     // radii, names and numbers of branches; no others are kept
    std::optional<StatedAxes> axes;  // by a field SPACE or the title
};

/// By the file's extension. Throws InputError for a file that is missing, truncated, of another kind, or
/// inconsistent: counts, indices, numbers that are not finite, more than 4 million triangles.
PolyData load_polydata(const std::filesystem::path&);

/// Whether an array of this name holds radii: "Radius", "MaximumInscribedSphereRadius".
bool is_radius(std::string_view name);

/// The same from text; `file` is for messages.
PolyData parse_vtp(const std::string& text, const std::string& file);
PolyData parse_legacy_vtk(const std::string& text, const std::string& file);

/// Most points of a file, and most indices of its cells of one kind.
constexpr std::int64_t most_points = 12'000'000, most_indices = 16'000'000;

using io::NumberType;
/// Of an attribute as in "UInt8", or of a legacy file's "unsigned_char".
std::optional<NumberType> number_type_named(std::string_view);

/// The numbers that bytes stand for; a rest shorter than a number is left out. Whole numbers that Number
/// cannot hold become negative.
template <class Number>
std::vector<Number> unpacked(std::string_view bytes, NumberType type, bool big_endian) {
    return io::with_stored_type(type, [&]<class Stored>(Stored) {
        std::vector<Number> numbers(bytes.size() / sizeof(Stored));
        for (std::size_t i = 0; i < numbers.size(); ++i)
            numbers[i] =
                static_cast<Number>(io::stored_number<Stored>(bytes.data() + i * sizeof(Stored), big_endian));
        return numbers;
    });
}

/// The kinds of cells in the order in which a file's arrays of cells list them.
enum class CellKind { Verts, Lines, Polys, Strips };
constexpr std::array<const char*, 4> cell_kinds = {"Verts", "Lines", "Polys", "Strips"};

/// The cells of one kind: the indices of all in a row, and where each cell ends.
struct CellList {
    std::vector<std::int64_t> indices, ends;
};

/// Throws InputError of "FILE: PLACE: found; expected".
[[noreturn]] void refuse_polydata(const std::string& file, std::string_view place, std::string_view found,
                                  std::string_view accepted);

/// Adds a piece's points and cells.
void add_piece(PolyData&, const geometry::Polyline& points, const std::array<CellList, 4>& cells,
               const std::string& file);
/// Whether an array of this name is kept: a radius, or the number of a branch.
bool keeps_numbers(std::string_view name);
/// Adds arrays to those of the pieces before, which have so many values; a name that one of them lacks is
/// dropped.
void add_arrays(std::vector<PolyData::Array>& all, std::vector<PolyData::Array> piece, int before);
/// Takes the field SPACE from the arrays of the file.
void take_axes(PolyData&);
/// The texts that a row of bytes separated by zeros holds.
std::vector<std::string> texts_of(std::string_view bytes);

}  // namespace anatomy
