#include "engine/anatomy/import/given_centrelines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <optional>
#include <pugixml.hpp>
#include <sstream>

#include "engine/anatomy/mesh_file.h"
#include "engine/anatomy/polydata.h"
#include "engine/anatomy/text_scanner.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::Vec3;
using nlohmann::ordered_json;

constexpr const char* accepted =
    "expected a JSON object {\"name\": [[x, y, z, r], …]} in the mesh's unit, a CSV with the header "
    "branch,x_mm,y_mm,z_mm[,r_mm], VTK PolyData with lines (.vtp, .vtk) or a SimVascular path (.pth)";

[[noreturn]] void refuse(const std::string& where, const std::string& found) {
    throw io::InputError("{}: {}; {}", where, found, accepted);
}

void append(GivenLine& line, const Vec3& point, std::optional<double> radius = {}) {
    if (!line.points.empty() && line.points.back() == point) return;
    line.points.push_back(point);
    if (radius) line.radii.push_back(*radius);
}

std::vector<GivenLine> from_json(const std::string& text, const std::string& file, double unit) {
    io::check_json_depth(text, file);
    const ordered_json root = ordered_json::parse(text, nullptr, false);
    if (!root.is_object()) refuse(file, "this is not a JSON object");
    std::vector<GivenLine> lines;
    for (const auto& [name, points] : root.items()) {
        GivenLine line;
        line.name = name;
        if (!points.is_array()) refuse(fmt::format("{}: '{}'", file, name), "not a list of points");
        for (const auto& point : points) {
            const bool numbers = point.is_array() && (point.size() == 3 || point.size() == 4) &&
                                 std::ranges::all_of(point, [](const auto& n) {
                                     return n.is_number() && std::isfinite(n.template get<double>());
                                 });
            if (!numbers)
                refuse(fmt::format("{}: '{}', point {}", file, name, line.points.size()),
                       point.dump(-1, ' ', false, ordered_json::error_handler_t::replace).substr(0, 60) +
                           " was found");
            const auto number = [&point](int k) { return point[k].template get<double>(); };
            append(line, unit * Vec3(number(0), number(1), number(2)),
                   point.size() == 4 ? std::optional(unit * number(3)) : std::nullopt);
        }
        lines.push_back(std::move(line));
    }
    return lines;
}

std::vector<GivenLine> from_csv(const std::string& text, const std::string& file) {
    std::istringstream stream(text);
    std::string row;
    std::getline(stream, row);
    if (row.ends_with('\r')) row.pop_back();
    const bool radii = row == "branch,x_mm,y_mm,z_mm,r_mm";
    if (!radii && row != "branch,x_mm,y_mm,z_mm")
        refuse(file + ":1", fmt::format("'{}' was found", row.substr(0, 60)));
    std::vector<GivenLine> lines;
    for (int number = 2; std::getline(stream, row); ++number) {
        if (row.ends_with('\r')) row.pop_back();
        if (row.empty()) continue;
        std::vector<std::string_view> cells = io::split(row, ',');
        if (cells.back().empty()) cells.pop_back();
        double values[4] = {};
        bool fine = cells.size() == (radii ? 5u : 4u);
        for (std::size_t k = 1; fine && k < cells.size(); ++k) {
            values[k - 1] = io::parse_number(cells[k]).value_or(std::nan(""));
            fine = std::isfinite(values[k - 1]);
        }
        if (!fine)
            refuse(fmt::format("{}:{}", file, number), fmt::format("'{}' was found", row.substr(0, 60)));
        if (lines.empty() || cells[0] != lines.back().name) lines.emplace_back().name = cells[0];
        append(lines.back(), {values[0], values[1], values[2]},
               radii ? std::optional(values[3]) : std::nullopt);
    }
    return lines;
}

/// A text for the line, else a number that VMTK or SimVascular gave its cell or its middle point.
std::string name_of(const PolyData& data, std::size_t index) {
    const PolyData::Line& line = data.lines[index];
    const auto cell = static_cast<std::size_t>(line.cell);
    for (const PolyData::Array& array : data.of_cells)
        if (cell < array.texts.size()) return array.texts[cell];
    for (const PolyData::Array& array : data.of_file)
        if (array.texts.size() == data.lines.size()) return array.texts[index];
    const auto middle = static_cast<std::size_t>(line.points[line.points.size() / 2]);
    for (const auto& [known, word] : {std::pair{"GroupIds", "group"},
                                      {"BranchId", "branch"},
                                      {"BranchIdTmp", "branch"},
                                      {"CenterlineIds", "centreline"},
                                      {"CenterlineId", "centreline"}}) {
        for (const PolyData::Array& array : data.of_cells)
            if (array.name == known && cell < array.numbers.size())
                return fmt::format("{}{:g}", word, array.numbers[cell]);
        for (const PolyData::Array& array : data.of_points)
            if (array.name == known && middle < array.numbers.size())
                return fmt::format("{}{:g}", word, array.numbers[middle]);
    }
    return {};
}

std::vector<GivenLine> from_polydata(const PolyData& data, double unit) {
    const auto radius = std::ranges::find_if(data.of_points, [&](const auto& array) {
        return is_radius(array.name) && array.numbers.size() == data.points.size();
    });
    std::vector<GivenLine> lines;
    for (std::size_t i = 0; i < data.lines.size(); ++i) {
        if (data.lines[i].points.empty()) continue;
        GivenLine line;
        line.name = name_of(data, i);
        for (const int p : data.lines[i].points) {
            const bool measured = radius != data.of_points.end();
            append(
                line, unit * data.points[p],
                measured ? std::optional(unit * radius->numbers[static_cast<std::size_t>(p)]) : std::nullopt);
        }
        lines.push_back(std::move(line));
    }
    return lines;
}

/// Points of the first time step; the control points where no others are stored.
std::vector<GivenLine> from_path(const std::string& text, const std::filesystem::path& path, double unit) {
    const std::string file = path.string();
    pugi::xml_document document;
    if (!document.load_buffer(text.data(), text.size(), pugi::parse_minimal)) refuse(file, "this is not XML");
    const pugi::xml_node element = document.child("path").child("timestep").child("path_element");
    if (!element) refuse(file, "there is no <path> with a <timestep> and a <path_element>");
    GivenLine line;
    line.name = path.stem().string();
    const auto add = [&](const pugi::xml_node& place) {
        Vec3 point;
        for (int k = 0; k < 3; ++k) {
            const std::string_view word = place.attribute(std::array{"x", "y", "z"}[k]).value();
            const auto value = io::parse_number(word);
            if (!value || !std::isfinite(*value))
                refuse(fmt::format("{}: point {}", file, line.points.size()),
                       fmt::format("{} = '{}' was found", std::array{"x", "y", "z"}[k], word.substr(0, 40)));
            point[k] = *value;
        }
        append(line, unit * point);
    };
    for (const pugi::xml_node point : element.child("path_points").children("path_point"))
        add(point.child("pos"));
    if (line.points.empty())
        for (const pugi::xml_node point : element.child("control_points").children("point")) add(point);
    return {line};
}

}  // namespace

std::vector<GivenLine> load_centrelines(const std::filesystem::path& path, double unit) {
    const std::string file = path.string();
    const std::string extension = extension_of(path);
    std::error_code unknown;
    const std::uintmax_t size = std::filesystem::file_size(path, unknown);
    if (!unknown && size > (std::size_t{100} << 20)) refuse(file, "more than 100 MB were found");
    const std::string text = io::read_text(path, "file", accepted);
    std::vector<GivenLine> lines = extension == ".csv"   ? from_csv(text, file)
                                   : extension == ".vtp" ? from_polydata(parse_vtp(text, file), unit)
                                   : extension == ".vtk" ? from_polydata(parse_legacy_vtk(text, file), unit)
                                   : extension == ".pth" ? from_path(text, path, unit)
                                                         : from_json(text, file, unit);
    std::erase_if(lines, [](const GivenLine& line) { return line.points.size() < 2; });
    if (lines.empty()) refuse(file, "no line of two points or more was found");
    for (const GivenLine& line : lines) {
        for (const Vec3& p : line.points)
            if (!(p.cwiseAbs().maxCoeff() <= largest_coordinate))
                refuse(fmt::format("{}: '{}'", file, line.name),
                       fmt::format("a point at ({:g}, {:g}, {:g}) mm was found, beyond {:g}", p.x(), p.y(),
                                   p.z(), largest_coordinate));
        for (const double radius : line.radii)
            if (!(std::abs(radius) <= largest_coordinate))
                refuse(fmt::format("{}: '{}'", file, line.name),
                       fmt::format("a radius of {:g} mm was found, beyond {:g}", radius, largest_coordinate));
    }
    return lines;
}

}  // namespace anatomy
