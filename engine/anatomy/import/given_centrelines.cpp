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
#include "engine/io/wall.h"

namespace anatomy {
namespace {

using geometry::Vec3;
using nlohmann::ordered_json;

constexpr const char* accepted =
    "expected a JSON object {\"name\": [[x, y, z, r], …]} in the mesh's unit, a CSV with the header "
    "branch,x_mm,y_mm,z_mm[,r_mm], VTK PolyData with lines (.vtp, .vtk), a SimVascular path (.pth), curves "
    "of 3D "
    "Slicer (.mrk.json) or a table of VMTK (.dat)";

[[noreturn]] void refuse(const std::string& where, const std::string& found) {
    throw io::InputError("{}: {}; {}", where, found, accepted);
}

void append(GivenLine& line, const Vec3& point, std::optional<double> radius = {}) {
    if (!line.points.empty() && line.points.back() == point) return;
    line.points.push_back(point);
    if (radius) line.radii.push_back(*radius);
}

/// Smooth through the points, as Slicer draws a curve: cubic, by chord lengths (Catmull and Rom).
GivenLine smooth(const GivenLine& given) {
    constexpr int pieces = 10;  // between two control points
    const std::size_t count = given.points.size();
    if (count < 3) return given;
    const bool measured = given.radii.size() == count;
    GivenLine line;
    line.name = given.name;
    const auto at = [&](std::ptrdiff_t i) {
        return given.points[static_cast<std::size_t>(
            std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(count) - 1))];
    };
    for (std::size_t i = 0; i + 1 < count; ++i) {
        const auto k = static_cast<std::ptrdiff_t>(i);
        const Vec3 &p = given.points[i], &q = given.points[i + 1];
        const double length = (q - p).norm();
        // Slopes by way; at an end that of the chord.
        const auto slope = [&](std::ptrdiff_t j) -> Vec3 {
            const double way = (at(j + 1) - at(j)).norm() + (at(j) - at(j - 1)).norm();
            return (at(j + 1) - at(j - 1)) / way;
        };
        const Vec3 m = length * slope(k), n = length * slope(k + 1);
        for (int step = 0; step < pieces; ++step) {
            const double t = static_cast<double>(step) / pieces, tt = t * t, ttt = tt * t;
            const Vec3 point =
                (2 * ttt - 3 * tt + 1) * p + (ttt - 2 * tt + t) * m + (3 * tt - 2 * ttt) * q + (ttt - tt) * n;
            append(
                line, point,
                measured ? std::optional((1 - t) * given.radii[i] + t * given.radii[i + 1]) : std::nullopt);
        }
    }
    append(line, given.points.back(), measured ? std::optional(given.radii.back()) : std::nullopt);
    return line;
}

/// The file's name without ".json" and ".mrk".
std::string name_of_markup(const std::filesystem::path& path) {
    const std::filesystem::path stem = path.stem();
    return io::lower_case(stem.extension().string()) == ".mrk" ? stem.stem().string() : stem.string();
}

class MarkupsReader {
public:
    explicit MarkupsReader(const std::filesystem::path& path) : path_(path) {}

    GivenLines read(const ordered_json& root) {
        const ordered_json& markups = root.at("markups");
        if (!markups.is_array()) refuse(path_.string(), "'markups' is not a list");
        std::vector<std::string> others;
        for (std::size_t i = 0; i < markups.size(); ++i) {
            where_ = fmt::format("{}: markup {}", path_.string(), i + 1);
            if (!markups[i].is_object()) refuse(where_, "it is not an object");
            const std::string type = word(markups[i], "type", "");
            if (type != "Curve" && type != "ClosedCurve" && type != "Line") {
                others.push_back(type);
                continue;
            }
            read_axes(markups[i]);
            read_line(markups[i], type, markups.size() > 1 ? fmt::format("_{}", i + 1) : "");
        }
        if (result_.lines.empty() && !others.empty())
            refuse(path_.string(),
                   fmt::format("markups of type {} were found, and no curve", io::joined(others)));
        return std::move(result_);
    }

private:
    std::string word(const ordered_json& of, const char* key, const std::string& otherwise) const {
        const auto found = of.find(key);
        if (found == of.end() || found->is_null()) return otherwise;
        if (!found->is_string()) refuse(where_, fmt::format("'{}' is not a text", key));
        return found->get<std::string>();
    }
    void read_axes(const ordered_json& markup) {
        const std::string units = word(markup, "coordinateUnits", "mm");
        if (units != "mm") refuse(where_, fmt::format("coordinateUnits '{}' was found", units.substr(0, 40)));
        const std::string system = word(markup, "coordinateSystem", "");
        if (system.empty()) return;
        StatedAxes stated =
            axes_named(system, fmt::format("its coordinateSystem is {}", system.substr(0, 40)));
        if (result_.axes && result_.axes->axes != stated.axes)
            refuse(where_, fmt::format("coordinateSystem {} was found after {}", system.substr(0, 40),
                                       result_.axes->axes));
        result_.axes = std::move(stated);
    }
    void read_line(const ordered_json& markup, const std::string& type, const std::string& number) {
        GivenLine line;
        const std::vector<double> radii = radii_of(markup);
        const ordered_json points = markup.value("controlPoints", ordered_json::array());
        if (!points.is_array()) refuse(where_, "'controlPoints' is not a list");
        std::vector<double> placed;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const auto fault = [&](const std::string& found) {
                refuse(fmt::format("{}, control point {}", where_, i + 1), found);
            };
            if (!points[i].is_object()) fault("it is not an object");
            const std::string status = word(points[i], "positionStatus", "defined");
            if (status != "defined") continue;
            const auto position = points[i].find("position");
            const bool numbers = position != points[i].end() && position->is_array() &&
                                 position->size() == 3 && std::ranges::all_of(*position, [](const auto& n) {
                                     return n.is_number() && std::isfinite(n.template get<double>());
                                 });
            if (!numbers) fault("it has no position of three finite numbers");
            const auto at = [&](int k) { return (*position)[k].template get<double>(); };
            append(line, {at(0), at(1), at(2)},
                   radii.size() == points.size() ? std::optional(radii[i]) : std::nullopt);
        }
        if (type == "ClosedCurve" && line.points.size() > 2) {
            line.points.push_back(line.points.front());
            if (!line.radii.empty()) line.radii.push_back(line.radii.front());
        }
        if (type != "Line") line = smooth(line);
        line.name = word(markup, "name", name_of_markup(path_) + number);
        result_.lines.push_back(std::move(line));
    }
    static std::vector<double> radii_of(const ordered_json& markup) {
        const ordered_json measurements = markup.value("measurements", ordered_json::array());
        for (const ordered_json& measurement : measurements) {
            if (!measurement.is_object() || !measurement.value("name", ordered_json()).is_string()) continue;
            if (!is_radius(measurement.at("name").get<std::string>())) continue;
            const ordered_json values = measurement.value("controlPointValues", ordered_json::array());
            std::vector<double> radii;
            for (const ordered_json& value : values)
                if (value.is_number() && value.get<double>() > 0) radii.push_back(value.get<double>());
            if (radii.size() == values.size()) return radii;
        }
        return {};
    }

    const std::filesystem::path& path_;
    std::string where_;
    GivenLines result_;
};

GivenLines from_json(const std::string& text, const std::filesystem::path& path, double unit) {
    const std::string file = path.string();
    io::check_json_depth(text, file);
    const ordered_json root = ordered_json::parse(text, nullptr, false);
    if (!root.is_object()) refuse(file, "this is not a JSON object");
    if (root.contains("markups")) return MarkupsReader(path).read(root);
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
    return {std::move(lines), {}};
}

/// Words of a head, then rows of numbers. Points of a line follow each other closely.
std::vector<GivenLine> from_table(const std::string& text, const std::filesystem::path& path, double unit) {
    constexpr double far = 10;  // times the median distance of neighbours
    const std::string file = path.string();
    std::istringstream stream(text);
    std::string row;
    std::getline(stream, row);
    const std::vector<std::string_view> head = io::words_of(row);
    const auto column = [&](auto is_it) { return std::ranges::find_if(head, is_it) - head.begin(); };
    std::array<std::ptrdiff_t, 3> axes{};
    for (int k = 0; k < 3; ++k)
        axes[k] = column([&](std::string_view word) {
            return same_word(word, std::array{"x", "y", "z"}[k]);
        });
    const std::ptrdiff_t radius = column(is_radius), columns = std::ssize(head);
    if (std::ranges::find(axes, columns) != axes.end())
        refuse(file + ":1", fmt::format("no columns X, Y and Z in '{}'", row.substr(0, 60)));
    GivenLine all;
    for (int number = 2; std::getline(stream, row); ++number) {
        const std::vector<std::string_view> words = io::words_of(row);
        if (words.empty()) continue;
        const auto value = [&](std::ptrdiff_t k) {
            const auto read =
                k < std::ssize(words) ? io::parse_number(words[static_cast<std::size_t>(k)]) : std::nullopt;
            if (!read || !std::isfinite(*read) || std::ssize(words) != columns)
                refuse(fmt::format("{}:{}", file, number), fmt::format("'{}' was found", row.substr(0, 60)));
            return unit * *read;
        };
        append(all, {value(axes[0]), value(axes[1]), value(axes[2])},
               radius < columns ? std::optional(value(radius)) : std::nullopt);
    }
    std::vector<double> steps;
    for (std::size_t i = 1; i < all.points.size(); ++i)
        steps.push_back((all.points[i] - all.points[i - 1]).norm());
    std::vector<double> sorted = steps;
    std::ranges::sort(sorted);
    const double most = sorted.empty() ? 0 : far * sorted[sorted.size() / 2];
    std::vector<GivenLine> lines(1);
    for (std::size_t i = 0; i < all.points.size(); ++i) {
        if (i > 0 && steps[i - 1] > most) lines.emplace_back();
        append(lines.back(), all.points[i], all.radii.empty() ? std::nullopt : std::optional(all.radii[i]));
    }
    for (std::size_t i = 0; i < lines.size(); ++i)
        lines[i].name = path.stem().string() + (lines.size() > 1 ? fmt::format("_{}", i + 1) : "");
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

GivenLines from_polydata(const PolyData& data, double unit) {
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
    return {std::move(lines), data.axes};
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

GivenPlaces load_places(const std::filesystem::path& path) {
    constexpr const char* points = "expected points of 3D Slicer (.mrk.json) with labels";
    const std::string file = path.string(), text = io::read_text(path, "file", points);
    io::check_json_depth(text, file);
    const ordered_json root = ordered_json::parse(text, nullptr, false);
    const auto fault = [&](const std::string& found) {
        throw io::InputError("{}: {}; {}", file, found, points);
    };
    if (!root.is_object() || !root.contains("markups") || !root.at("markups").is_array())
        fault("it holds no markups");
    GivenPlaces read;
    for (const ordered_json& markup : root.at("markups")) {
        if (!markup.is_object()) fault("a markup is not an object");
        if (const ordered_json system = markup.value("coordinateSystem", ordered_json()); system.is_string())
            read.axes = axes_named(system.get<std::string>().substr(0, 40),
                                   "its coordinateSystem is " + system.get<std::string>().substr(0, 40));
        const ordered_json list = markup.value("controlPoints", ordered_json::array());
        if (!list.is_array()) fault("'controlPoints' is not a list");
        for (const ordered_json& one : list) {
            const auto label = one.is_object() ? one.value("label", ordered_json()) : ordered_json();
            const auto position = one.is_object() ? one.value("position", ordered_json()) : ordered_json();
            bool fine = label.is_string() && position.is_array() && position.size() == 3;
            for (std::size_t k = 0; fine && k < 3; ++k)
                fine = position[k].is_number() && std::abs(position[k].get<double>()) <= largest_coordinate;
            if (!fine) fault(fmt::format("point {} has no label or place", read.places.size() + 1));
            read.places.emplace_back(
                label.get<std::string>(),
                Vec3(position[0].get<double>(), position[1].get<double>(), position[2].get<double>()));
        }
    }
    return read;
}

GivenLines load_centrelines(const std::filesystem::path& path, double unit) {
    const std::string file = path.string();
    const std::string extension = extension_of(path);
    std::error_code unknown;
    const std::uintmax_t size = std::filesystem::file_size(path, unknown);
    if (!unknown && size > (std::size_t{100} << 20)) refuse(file, "more than 100 MB were found");
    const auto read_here = [&](const io::Progress&) {
        const std::string text = io::read_text(path, "file", accepted);
        return extension == ".csv"   ? GivenLines{from_csv(text, file), {}}
               : extension == ".vtp" ? from_polydata(parse_vtp(text, file), unit)
               : extension == ".vtk" ? from_polydata(parse_legacy_vtk(text, file), unit)
               : extension == ".pth" ? GivenLines{from_path(text, path, unit), {}}
               : extension == ".dat" ? GivenLines{from_table(text, path, unit), {}}
                                     : from_json(text, path, unit);
    };
    GivenLines read = io::read_behind_wall(
        path, {}, read_here, [](geometry::StateStream& s, GivenLines& all) { s(all.lines, all.axes); });
    std::vector<GivenLine>& lines = read.lines;
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
    return read;
}

}  // namespace anatomy
