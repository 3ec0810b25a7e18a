#include "engine/anatomy/anatomy_writer.h"

#include <bit>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/io/error.h"
#include "engine/io/files.h"

namespace anatomy {
namespace {

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");

template <class Number>
void append(std::string& bytes, Number number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

std::string stl(const Anatomy& anatomy) {
    std::string bytes = "lumen of " + anatomy.name.substr(0, 60) + " [mm]";
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

/// Rounds to a nanometre; smaller digits are only rounding errors.
double rounded(double number) {
    return std::round(number * 1e6) / 1e6 + 0.0;
}
ordered_json point(const Vec3& p) {
    return {rounded(p.x()), rounded(p.y()), rounded(p.z())};
}

ordered_json branches(const Anatomy& anatomy) {
    ordered_json list = ordered_json::array();
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        ordered_json points = ordered_json::array();
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            ordered_json sample = point(branch.points[i]);
            sample.push_back(rounded(branch.radii[i]));
            points.push_back(std::move(sample));
        }
        ordered_json item = {
            {"name", branch.name}, {"parent", nullptr}, {"parent_sample", 0}, {"points", points}};
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
    for (const CalciumDeposit& deposit : anatomy.calcium) {
        ordered_json points = ordered_json::array();
        for (std::size_t i = 0; i < deposit.points.size(); ++i) {
            ordered_json sample = point(deposit.points[i]);
            sample.push_back(rounded(deposit.radii[i]));
            points.push_back(std::move(sample));
        }
        root["calcium"].push_back(std::move(points));
    }
    if (anatomy.body)
        root["body"] = {{"landmark", geometry::name_of(anatomy.body->landmark)},
                        {"at", point(anatomy.body->at)}};
    std::string text = "{";
    for (const auto& [key, value] : root.items())
        text += fmt::format("{}\n\"{}\":{}", text.size() > 1 ? "," : "", key, value.dump());
    return text + "\n}\n";
}

}  // namespace

void check_anatomy_name(const std::string& name) {
    const bool folder = name == "." || name == "..";
    if (!name.empty() && !folder && name.find_first_of("/\\\n") == std::string::npos && name.size() <= 100)
        return;
    throw io::InputError("--name: '{}' was found; expected a file name without a folder", name);
}

Anatomy read_back(const Anatomy& anatomy) {
    return parse_anatomy(description(anatomy, anatomy.name + ".stl", {}), stl(anatomy), anatomy.name);
}

std::filesystem::path write_anatomy(const Anatomy& anatomy, const std::filesystem::path& folder,
                                    const Provenance& provenance) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error || !std::filesystem::is_directory(folder)) {
        throw io::InputError("{}: the folder cannot be made: {}", folder.string(),
                             error ? error.message() : "a file is in its place");
    }
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
