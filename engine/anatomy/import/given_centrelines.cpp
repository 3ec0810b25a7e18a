#include "engine/anatomy/import/given_centrelines.h"

#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::Polyline;
using geometry::Vec3;
using nlohmann::ordered_json;

constexpr const char* accepted =
    "a JSON object {\"name\": [[x, y, z, r], …]} in the mesh's unit, or a CSV with the header "
    "branch,x_mm,y_mm,z_mm[,r_mm], is accepted";

[[noreturn]] void refuse(const std::string& where, const std::string& found) {
    throw io::InputError(fmt::format("{}: {}; {}", where, found, accepted));
}

void append(Polyline& line, const Vec3& point) {
    if (line.empty() || line.back() != point) line.push_back(point);
}

std::vector<Polyline> from_json(const std::string& text, const std::string& file, double unit) {
    const ordered_json root = ordered_json::parse(text, nullptr, false);
    if (!root.is_object()) refuse(file, "this is not a JSON object");
    std::vector<Polyline> lines;
    for (const auto& [name, points] : root.items()) {
        Polyline line;
        if (!points.is_array()) refuse(fmt::format("{}: '{}'", file, name), "not a list of points");
        for (const auto& point : points) {
            const bool numbers = point.is_array() && (point.size() == 3 || point.size() == 4) &&
                                 std::all_of(point.begin(), point.end(), [](const auto& n) {
                                     return n.is_number() && std::isfinite(n.template get<double>());
                                 });
            if (!numbers)
                refuse(fmt::format("{}: '{}', point {}", file, name, line.size()),
                       point.dump().substr(0, 60) + " was found");
            append(line, unit * Vec3(point[0].get<double>(), point[1].get<double>(), point[2].get<double>()));
        }
        lines.push_back(std::move(line));
    }
    return lines;
}

std::vector<Polyline> from_csv(const std::string& text, const std::string& file) {
    std::istringstream stream(text);
    std::string row, name;
    std::getline(stream, row);
    if (row.ends_with('\r')) row.pop_back();
    const bool radii = row == "branch,x_mm,y_mm,z_mm,r_mm";
    if (!radii && row != "branch,x_mm,y_mm,z_mm")
        refuse(file + ":1", fmt::format("'{}' was found", row.substr(0, 60)));
    std::vector<Polyline> lines;
    for (int number = 2; std::getline(stream, row); ++number) {
        if (row.ends_with('\r')) row.pop_back();
        if (row.empty()) continue;
        std::vector<std::string> cells;
        std::istringstream parts(row);
        for (std::string cell; std::getline(parts, cell, ',');) cells.push_back(cell);
        Vec3 point;
        bool fine = cells.size() == (radii ? 5u : 4u);
        for (std::size_t k = 1; fine && k < cells.size(); ++k) {
            const auto value = io::parse_number(cells[k]);
            fine = value && std::isfinite(*value);
            if (fine && k <= 3) point[static_cast<int>(k) - 1] = *value;
        }
        if (!fine)
            refuse(fmt::format("{}:{}", file, number), fmt::format("'{}' was found", row.substr(0, 60)));
        if (lines.empty() || cells[0] != name) lines.emplace_back(), name = cells[0];
        append(lines.back(), point);
    }
    return lines;
}

}  // namespace

std::vector<Polyline> load_centrelines(const std::filesystem::path& path, double unit) {
    const std::string file = path.string();
    std::error_code unknown;
    const std::uintmax_t size = std::filesystem::file_size(path, unknown);
    if (!unknown && size > (std::size_t{100} << 20)) refuse(file, "more than 100 MB were found");
    const std::string text = io::read_text(path, "file", accepted);
    std::vector<Polyline> lines =
        path.extension() == ".csv" ? from_csv(text, file) : from_json(text, file, unit);
    std::erase_if(lines, [](const Polyline& line) { return line.size() < 2; });
    if (lines.empty()) refuse(file, "no line of two points or more was found");
    return lines;
}

}  // namespace anatomy
