#include "engine/anatomy/anatomy_writer.h"

#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/mesh_file.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using nlohmann::json;

/// One value of the file and the path to it, for messages such as `ends[2].radius: …`.
class Value {
public:
    Value(const json& value, std::string file, std::string path)
        : value_(value), file_(std::move(file)), path_(std::move(path)) {}

    [[noreturn]] void refuse(const std::string& accepted) const {
        std::string found = value_.dump();
        if (found.size() > 60) found = found.substr(0, 57) + "...";
        throw io::InputError("{}: {}: {} was found; {}", file_, path_, found, accepted);
    }
    Value operator[](const std::string& key) const {
        if (!value_.is_object()) refuse("expected an object");
        if (!value_.contains(key)) {
            throw io::InputError("{}: {}'{}' is missing", file_, path_.empty() ? "" : path_ + ": ", key);
        }
        return {value_.at(key), file_, path_.empty() ? key : path_ + "." + key};
    }
    std::vector<Value> items() const {
        if (!value_.is_array()) refuse("expected a list");
        std::vector<Value> result;
        for (std::size_t i = 0; i < value_.size(); ++i) {
            result.emplace_back(value_[i], file_, fmt::format("{}[{}]", path_, i));
        }
        return result;
    }
    double number() const {
        if (!value_.is_number() || !std::isfinite(value_.get<double>())) refuse("expected a finite number");
        if (std::abs(value_.get<double>()) > largest_coordinate)
            refuse(fmt::format("expected a number up to {:g}", largest_coordinate));
        return value_.get<double>();
    }
    int index() const {
        if (!value_.is_number_integer()) refuse("expected a whole number");
        const auto number = value_.get<std::int64_t>();
        if (number < 0 || number > 100'000'000) refuse("expected a whole number from 0");
        return static_cast<int>(number);
    }
    bool has(const std::string& key) const { return value_.is_object() && value_.contains(key); }
    bool is_null() const { return value_.is_null(); }
    std::string word() const {
        if (!value_.is_string()) refuse("expected a text");
        return value_.get<std::string>();
    }
    std::vector<double> numbers(std::size_t count) const {
        const std::vector<Value> list = items();
        if (list.size() != count) refuse(fmt::format("expected {} numbers", count));
        std::vector<double> result;
        for (const Value& item : list) result.push_back(item.number());
        return result;
    }
    Vec3 point() const {
        const std::vector<double> p = numbers(3);
        return {p[0], p[1], p[2]};
    }

private:
    const json& value_;
    std::string file_, path_;
};

/// Resolves a name, which must refer to a branch listed before.
int branch_index(const Anatomy& anatomy, const Value& name) {
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        if (anatomy.branches[b].name == name.word()) return static_cast<int>(b);
    }
    name.refuse("expected the name of a branch listed before");
}

void read_branches(const Value& list, Anatomy& anatomy) {
    for (const Value& item : list.items()) {
        geometry::CentrelineBranch branch;
        branch.name = item["name"].word();
        if (!item["parent"].is_null()) {
            branch.parent = branch_index(anatomy, item["parent"]);
            branch.parent_sample = item["parent_sample"].index();
            const auto samples = anatomy.branches[branch.parent].points.size();
            if (branch.parent_sample >= static_cast<int>(samples)) {
                item["parent_sample"].refuse(fmt::format("expected 0 to {}", samples - 1));
            }
        }
        for (const Value& sample : item["points"].items()) {
            const std::vector<double> p = sample.numbers(4);
            if (!(p[3] > 0)) sample.refuse("expected x, y, z and a radius above 0");
            branch.points.emplace_back(p[0], p[1], p[2]);
            branch.radii.push_back(p[3]);
        }
        if (branch.points.size() < 2) item["points"].refuse("expected two points or more");
        anatomy.branches.push_back(std::move(branch));
    }
}

void read_ends(const Value& list, Anatomy& anatomy) {
    std::set<std::string> names;
    for (const Value& item : list.items()) {
        VesselEnd end;
        end.opening.name = item["name"].word();
        if (!names.insert(end.opening.name).second)
            item["name"].refuse("expected a name that no other end has");
        end.opening.centre = item["centre"].point();
        const Vec3 normal = item["normal"].point();
        if (std::abs(normal.norm() - 1) > 1e-3) item["normal"].refuse("expected a unit vector");
        end.opening.outward_normal = normal.normalized();
        end.opening.radius = item["radius"].number();
        if (!(end.opening.radius > 0)) item["radius"].refuse("expected a radius above 0");
        const std::string role = item["role"].word();
        if (role != "inlet" && role != "outlet") item["role"].refuse("expected 'inlet' or 'outlet'");
        end.role = role == "inlet" ? EndRole::Inlet : EndRole::Outlet;
        anatomy.ends.push_back(std::move(end));
    }
}

void read_targets(const Value& list, Anatomy& anatomy) {
    for (const Value& item : list.items()) {
        VesselTarget target;
        target.name = item["name"].word();
        target.branch = branch_index(anatomy, item["branch"]);
        target.sample = item["sample"].index();
        const geometry::Polyline& points = anatomy.branches[target.branch].points;
        if (target.sample >= static_cast<int>(points.size())) {
            item["sample"].refuse(fmt::format("expected 0 to {}", points.size() - 1));
        }
        target.centre = points[target.sample];
        anatomy.targets.push_back(std::move(target));
    }
}

void read_calcium(const Value& list, Anatomy& anatomy) {
    for (const Value& item : list.items()) {
        CalciumDeposit deposit;
        for (const Value& sample : item.items()) {
            const std::vector<double> p = sample.numbers(4);
            if (!(p[3] > 0 && p[3] <= 10)) sample.refuse("expected x, y, z and a radius of up to 10 mm");
            deposit.points.emplace_back(p[0], p[1], p[2]);
            deposit.radii.push_back(p[3]);
        }
        if (deposit.points.size() < 2) item.refuse("expected two points or more");
        anatomy.calcium.push_back(std::move(deposit));
    }
}

geometry::BodyPlace read_body(const Value& body) {
    const std::optional<geometry::Landmark> landmark = geometry::landmark_named(body["landmark"].word());
    if (!landmark) {
        std::string accepted;
        for (const std::string_view name : geometry::landmark_names())
            accepted += fmt::format("{}'{}'", accepted.empty() ? "" : " or ", name);
        body["landmark"].refuse("expected " + accepted);
    }
    return {*landmark, body["at"].point()};
}

json parse_json(const std::string& text, const std::filesystem::path& path) {
    io::check_json_depth(text, path.string());
    try {
        return json::parse(text);
    } catch (const json::parse_error& error) {
        io::TextPlace place{path.string(), 1, 1};
        for (std::size_t i = 0; i + 1 < error.byte && i < text.size(); ++i) {
            if (text[i] == '\n')
                ++place.line, place.column = 1;
            else
                ++place.column;
        }
        throw io::InputError(
            io::located(place, "this is not JSON; expected a vessel anatomy written as JSON"));
    } catch (const json::exception&) {
        throw io::InputError(path.string() + ": a number is too large; expected finite numbers");
    }
}

json parse_file(const std::filesystem::path& path) {
    return parse_json(io::read_text(path, "anatomy", "expected a NAME.anatomy.json"), path);
}

/// The anatomy of the file at the path; `mesh_at` gives the mesh of another path.
template <class MeshAt>
Anatomy read_anatomy(const json& content, const std::filesystem::path& path, const MeshAt& mesh_at) {
    const std::string file = path.string();
    const Value root(content, file, "");
    if (root["format"].word() != "vessel-anatomy") root["format"].refuse("expected 'vessel-anatomy'");
    if (root["version"].index() != 1) root["version"].refuse("expected version 1");
    if (root["units"].word() != "mm") root["units"].refuse("expected 'mm'");
    if (root["frame"].word() != "LPS") root["frame"].refuse("expected 'LPS'");

    Anatomy anatomy;
    anatomy.name = root["name"].word();
    read_branches(root["branches"], anatomy);
    read_ends(root["ends"], anatomy);
    read_targets(root["targets"], anatomy);
    if (root.has("calcium")) read_calcium(root["calcium"], anatomy);
    if (root.has("body")) anatomy.body = read_body(root["body"]);

    const Value mesh = root["mesh"];
    const std::filesystem::path mesh_path = io::file_beside(path, "mesh.file", mesh["file"].word());
    anatomy.lumen = mesh_at(mesh_path);
    if (const int declared = mesh["triangles"].index();
        declared != static_cast<int>(anatomy.lumen.triangles.size())) {
        throw io::InputError("{}: {} triangles were found; {} declares {}", mesh_path.string(),
                             anatomy.lumen.triangles.size(), file, declared);
    }
    std::vector<std::string> wrong = problems(anatomy);
    for (std::string& problem : wrong) problem.insert(0, mesh_path.string() + ": ");
    if (!wrong.empty()) throw io::InputError(io::joined(wrong, "\n"));
    return anatomy;
}

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");

template <class Number>
void append(std::string& bytes, Number number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

std::string stl(const Anatomy& anatomy, std::string head) {
    std::string bytes = std::move(head);
    bytes.resize(80, ' ');
    append(bytes, static_cast<std::uint32_t>(anatomy.lumen.triangles.size()));
    for (const auto& t : anatomy.lumen.triangles) {
        const Vec3 &a = anatomy.lumen.vertices[t[0]], &b = anatomy.lumen.vertices[t[1]],
                   &c = anatomy.lumen.vertices[t[2]];
        for (const Vec3& v : {Vec3((b - a).cross(c - a).normalized()), a, b, c})
            for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(v[axis]));
        append(bytes, std::uint16_t{0});
    }
    return bytes;
}

std::string stl(const Anatomy& anatomy) {
    return stl(anatomy, "lumen of " + anatomy.name.substr(0, 60) + " [mm]");
}

/// Rounds to a nanometre; smaller digits are only rounding errors.
double rounded(double number) {
    return std::round(number * 1e6) / 1e6 + 0.0;
}
ordered_json point(const Vec3& p) {
    return {rounded(p.x()), rounded(p.y()), rounded(p.z())};
}

/// Points with radii.
ordered_json samples(const auto& line) {
    ordered_json list = ordered_json::array();
    for (std::size_t i = 0; i < line.points.size(); ++i) {
        list.push_back(point(line.points[i]));
        list.back().push_back(rounded(line.radii[i]));
    }
    return list;
}

ordered_json branches(const Anatomy& anatomy) {
    ordered_json list = ordered_json::array();
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        ordered_json item = {
            {"name", branch.name}, {"parent", nullptr}, {"parent_sample", 0}, {"points", samples(branch)}};
        if (branch.parent >= 0) {
            item["parent"] = anatomy.branches[branch.parent].name;
            item["parent_sample"] = branch.parent_sample;
        }
        list.push_back(std::move(item));
    }
    return list;
}

std::string description(const Anatomy& anatomy, const std::string& mesh_file, const Provenance& provenance) {
    ordered_json ends = ordered_json::array(), targets = ordered_json::array(), made = ordered_json::object();
    for (const VesselEnd& end : anatomy.ends) {
        ends.push_back({{"name", end.opening.name},
                        {"centre", point(end.opening.centre)},
                        {"normal", point(end.opening.outward_normal)},
                        {"radius", rounded(end.opening.radius)},
                        {"role", end.role == EndRole::Inlet ? "inlet" : "outlet"}});
    }
    for (const VesselTarget& target : anatomy.targets) {
        targets.push_back({{"name", target.name},
                           {"branch", anatomy.branches[target.branch].name},
                           {"sample", target.sample}});
    }
    for (const auto& [key, text] : provenance) made[key] = text;
    ordered_json root = {{"format", "vessel-anatomy"},
                         {"version", 1},
                         {"units", "mm"},
                         {"frame", "LPS"},
                         {"name", anatomy.name},
                         {"mesh",
                          {{"file", mesh_file},
                           {"triangles", anatomy.lumen.triangles.size()},
                           {"normals", "outward"},
                           {"watertight", anatomy.ends.empty()},
                           {"open_ends", anatomy.ends.size()}}},
                         {"branches", branches(anatomy)},
                         {"ends", ends},
                         {"targets", targets},
                         {"provenance", made}};
    for (const CalciumDeposit& deposit : anatomy.calcium) root["calcium"].push_back(samples(deposit));
    if (anatomy.body)
        root["body"] = {{"landmark", geometry::name_of(anatomy.body->landmark)},
                        {"at", point(anatomy.body->at)}};
    std::string text = "{";
    for (const auto& [key, value] : root.items())
        text += fmt::format("{}\n\"{}\":{}", text.size() > 1 ? "," : "", key, value.dump());
    return text + "\n}\n";
}

}  // namespace

Anatomy load_anatomy(const std::filesystem::path& path) {
    return read_anatomy(parse_file(path), path, load_mesh);
}

Anatomy parse_anatomy(const std::string& text, const std::string& stl, const std::string& name) {
    return read_anatomy(parse_json(text, name), name,
                        [&](const std::filesystem::path&) { return parse_stl(stl, name); });
}

std::optional<std::filesystem::path> mesh_named_by(const std::filesystem::path& path) {
    try {
        const json content = parse_file(path);
        return io::file_beside(path, "mesh.file", Value(content, path.string(), "")["mesh"]["file"].word());
    } catch (const io::InputError&) {
        return std::nullopt;
    }
}

void check_anatomy_name(const std::string& name) {
    const bool folder = name == "." || name == "..";
    if (!name.empty() && !folder && name.find_first_of("/\\\n") == std::string::npos && name.size() <= 100)
        return;
    throw io::InputError("--name: '{}' was found; expected a file name without a folder", name);
}

std::string markup(const std::string& type, const std::string& name, const geometry::Polyline& points,
                   const std::vector<std::string>& labels, const std::vector<double>& radii) {
    ordered_json list = ordered_json::array(), measurements = ordered_json::array();
    for (std::size_t i = 0; i < points.size(); ++i)
        list.push_back({{"id", std::to_string(i + 1)},
                        {"label", i < labels.size() ? labels[i] : fmt::format("{}-{}", name, i + 1)},
                        {"position", point(points[i])},
                        {"selected", true},
                        {"locked", false},
                        {"visibility", true},
                        {"positionStatus", "defined"}});
    if (radii.size() == points.size() && !points.empty()) {
        ordered_json values = ordered_json::array();
        for (const double radius : radii) values.push_back(rounded(radius));
        measurements.push_back(
            {{"name", "Radius"}, {"enabled", true}, {"units", "mm"}, {"controlPointValues", values}});
    }
    const ordered_json root = {
        {"@schema",
         "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
         "markups-schema-v1.0.3.json#"},
        {"markups",
         {{{"type", type},
           {"name", name},
           {"coordinateSystem", "LPS"},
           {"coordinateUnits", "mm"},
           {"locked", true},
           {"labelFormat", "%N-%d"},
           {"controlPoints", list},
           {"measurements", measurements}}}}};
    return root.dump(1) + "\n";
}

std::vector<std::filesystem::path> write_for_slicer(const Anatomy& anatomy,
                                                    const std::filesystem::path& folder) {
    io::make_folder(folder / "centrelines");
    std::vector<std::filesystem::path> files;
    const auto write = [&](const std::filesystem::path& file, const std::string& text) {
        io::write_whole(file, text);
        files.push_back(file);
    };
    write(folder / (io::file_name_of(anatomy.name) + ".stl"), stl(anatomy, "3D Slicer output. SPACE=LPS"));
    std::vector<std::string> names;
    geometry::Polyline places;
    for (const VesselEnd& end : anatomy.ends) {
        names.push_back(end.opening.name);
        places.push_back(end.opening.centre);
    }
    write(folder / "ends.mrk.json", markup("Fiducial", "ends", places, names));
    names.clear(), places.clear();
    for (const VesselTarget& target : anatomy.targets) {
        names.push_back(target.name);
        places.push_back(target.centre);
    }
    write(folder / "targets.mrk.json", markup("Fiducial", "targets", places, names));
    for (const geometry::CentrelineBranch& branch : anatomy.branches)
        write(folder / "centrelines" / (io::file_name_of(branch.name) + ".mrk.json"),
              markup("Curve", branch.name, branch.points, {}, branch.radii));
    return files;
}

Anatomy read_back(const Anatomy& anatomy) {
    return parse_anatomy(description(anatomy, anatomy.name + ".stl", {}), stl(anatomy), anatomy.name);
}

std::filesystem::path write_anatomy(const Anatomy& anatomy, const std::filesystem::path& folder,
                                    const Provenance& provenance) {
    io::make_folder(folder);
    std::error_code error;
    const std::string mesh_file = anatomy.name + ".stl";
    const std::filesystem::path path = folder / (anatomy.name + ".anatomy.json");
    io::write_whole(folder / mesh_file, stl(anatomy));
    try {
        io::write_whole(path, description(anatomy, mesh_file, provenance));
    } catch (const io::InputError&) {
        std::filesystem::remove(folder / mesh_file, error);
        throw;
    }
    return path;
}

}  // namespace anatomy
