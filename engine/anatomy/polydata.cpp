#include "engine/anatomy/polydata.h"

#include <algorithm>
#include <fmt/format.h>

#include "engine/anatomy/mesh_file.h"
#include "engine/anatomy/text_scanner.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

constexpr std::uintmax_t most_polydata_bytes = std::uintmax_t{1} << 30;

void add_triangle(PolyData& data, std::int64_t a, std::int64_t b, std::int64_t c, int first) {
    const auto corner = [first](std::int64_t i) { return first + static_cast<int>(i); };
    data.triangles.push_back({corner(a), corner(b), corner(c)});
}

}  // namespace

bool is_radius(std::string_view name) {
    return name.ends_with("Radius") || name.ends_with("radius") || same_word(name, "r");
}

void refuse_polydata(const std::string& file, std::string_view place, std::string_view found,
                     std::string_view accepted) {
    throw io::InputError("{}: {}{}{}; {}", file, place, place.empty() ? "" : ": ", found, accepted);
}

std::optional<NumberType> number_type_named(std::string_view name) {
    // A long is of 64 bits wherever such files are written today; an identifier is written as an int.
    constexpr io::NumberNames names = {
        "int8,char,signed_char,vtktypeint8", "uint8,unsigned_char,vtktypeuint8",
        "int16,short,vtktypeint16",          "uint16,unsigned_short,vtktypeuint16",
        "int32,int,vtkidtype,vtktypeint32",  "uint32,unsigned_int,vtktypeuint32",
        "int64,long,vtktypeint64",           "uint64,unsigned_long,vtktypeuint64",
        "float32,float,vtktypefloat32",      "float64,double,vtktypefloat64"};
    return io::number_type_named(io::lower_case(name), names);
}

bool keeps_numbers(std::string_view name) {
    for (const char* known : {"GroupIds", "CenterlineIds", "CenterlineId", "BranchId", "BranchIdTmp"})
        if (same_word(name, known)) return true;
    return is_radius(name);
}

void take_axes(PolyData& data) {
    std::erase_if(data.of_file, [&](const PolyData::Array& array) {
        if (!same_word(array.name, "SPACE")) return false;
        if (!array.texts.empty())
            data.axes = axes_named(array.texts[0].substr(0, 40),
                                   "the field SPACE says " + array.texts[0].substr(0, 40));
        return true;
    });
}

std::vector<std::string> texts_of(std::string_view bytes) {
    std::vector<std::string> texts;
    while (!bytes.empty()) {
        const std::size_t end = std::min(bytes.find('\0'), bytes.size());
        texts.emplace_back(bytes.substr(0, end));
        bytes.remove_prefix(std::min(end + 1, bytes.size()));
    }
    return texts;
}

void add_piece(PolyData& data, const geometry::Polyline& points, const std::array<CellList, 4>& cells,
               const std::string& file) {
    const int first = static_cast<int>(data.points.size());
    const auto count = static_cast<std::int64_t>(points.size());
    if (first + count > most_points)
        refuse_polydata(file, "Points", fmt::format("{} were found", first + count),
                        fmt::format("expected at most {}", most_points));
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!points[i].allFinite())
            refuse_polydata(file, fmt::format("point {}", i), "it is not of finite numbers",
                            "expected finite numbers");
    data.points.insert(data.points.end(), points.begin(), points.end());
    for (std::size_t kind = 0; kind < cells.size(); ++kind) {
        const CellList& list = cells[kind];
        for (std::size_t i = 0; i < list.indices.size(); ++i)
            if (list.indices[i] < 0 || list.indices[i] >= count)
                refuse_polydata(
                    file, cell_kinds[kind], fmt::format("index {} is {}", i, list.indices[i]),
                    count == 0 ? "there are no points to name" : fmt::format("expected 0 to {}", count - 1));
        std::int64_t from = 0;
        for (const std::int64_t end : list.ends) {
            if (end < from || end > static_cast<std::int64_t>(list.indices.size()))
                refuse_polydata(file, cell_kinds[kind],
                                fmt::format("a cell goes from index {} to {}", from, end),
                                fmt::format("expected ends that rise up to {}", list.indices.size()));
            const std::span<const std::int64_t> cell(list.indices.data() + from,
                                                     static_cast<std::size_t>(end - from));
            from = end;
            if (kind == static_cast<std::size_t>(CellKind::Lines)) {
                data.lines.emplace_back().cell = data.cells;
                for (const std::int64_t i : cell)
                    data.lines.back().points.push_back(first + static_cast<int>(i));
            } else if (kind == static_cast<std::size_t>(CellKind::Polys)) {
                for (std::size_t i = 2; i < cell.size(); ++i)
                    add_triangle(data, cell[0], cell[i - 1], cell[i], first);
            } else if (kind == static_cast<std::size_t>(CellKind::Strips)) {
                // Every other triangle of a strip is turned round.
                for (std::size_t i = 2; i < cell.size(); ++i)
                    add_triangle(data, cell[i - 2 + i % 2], cell[i - 1 - i % 2], cell[i], first);
            }
            ++data.cells;
        }
        if (static_cast<double>(data.triangles.size()) > most_triangles)
            refuse_polydata(file, cell_kinds[kind],
                            fmt::format("{} triangles were found", data.triangles.size()),
                            fmt::format("expected at most {:.0f} million", most_triangles / 1e6));
    }
}

void add_arrays(std::vector<PolyData::Array>& all, std::vector<PolyData::Array> piece, int before) {
    if (before == 0) {
        all = std::move(piece);
        return;
    }
    std::erase_if(all, [&](const PolyData::Array& array) {
        return std::ranges::none_of(piece,
                                    [&](const PolyData::Array& more) { return more.name == array.name; });
    });
    for (PolyData::Array& array : all) {
        const auto more = std::ranges::find(piece, array.name, &PolyData::Array::name);
        array.numbers.insert(array.numbers.end(), more->numbers.begin(), more->numbers.end());
        array.texts.insert(array.texts.end(), more->texts.begin(), more->texts.end());
    }
}

PolyData load_polydata(const std::filesystem::path& path) {
    const std::string file = path.string();
    std::error_code unknown;
    if (const std::uintmax_t size = std::filesystem::file_size(path, unknown);
        !unknown && size > most_polydata_bytes)
        refuse_polydata(file, "", fmt::format("{} bytes were found", size),
                        fmt::format("expected at most {}", most_polydata_bytes));
    const std::string text = io::read_text(path, "file", "expected VTK PolyData, .vtp or .vtk");
    return extension_of(path) == ".vtk" ? parse_legacy_vtk(text, file) : parse_vtp(text, file);
}

}  // namespace anatomy
