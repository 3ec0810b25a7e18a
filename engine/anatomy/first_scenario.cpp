#include "engine/anatomy/first_scenario.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/anatomy/lumen_wall.h"
#include "engine/io/text.h"
#include "physics/geometry/polyline.h"

namespace anatomy {
namespace {

/// Of the way to the target, and at most [mm].
constexpr double inserted_fraction = 0.4, most_inserted = 60;
/// Of the lumen's width; a wire as wide as the lumen would be wedged by the mesh's facets.
constexpr double width_fraction = 0.9;
/// What the default C-arm shows around its isocentre, with a margin [mm].
constexpr double field = 170;

std::string decimal(double number) {
    return io::number_text(std::round(number * 10) / 10 + 0.0);
}

constexpr FirstWire wires[] = {
    {"glide035", 0.889, 16}, {"v18", 0.457, 8}, {"standard014", 0.356, 8}, {"floppy014", 0.356, 8}};

/// The first that passes as far as the target and has room at the start; the thinnest if none.
const FirstWire& wire_for(double narrowest, double room) {
    for (const FirstWire& wire : wires)
        if (wire.diameter < width_fraction * narrowest && wire.least_inserted <= room) return wire;
    return std::end(wires)[-1];
}

}  // namespace

std::span<const FirstWire> first_wires() {
    return wires;
}

std::string first_scenario(const Anatomy& anatomy, const std::filesystem::path& file) {
    int entry = 0;
    for (int e = static_cast<int>(anatomy.ends.size()); e-- > 0;)
        if (anatomy.ends[e].role == EndRole::Inlet) entry = e;
    const EntryPath path = path_from(anatomy, entry);
    const std::vector<double> arcs = geometry::arc_lengths(path.points);
    const VesselTarget& target = anatomy.targets.front();
    // The way in may leave for the target's branch before its own end.
    std::size_t last = 0;
    for (std::size_t i = 1; i < arcs.size(); ++i)
        if ((path.points[i] - target.centre).norm() < (path.points[last] - target.centre).norm()) last = i;
    last = std::max<std::size_t>(last, 1);
    double narrowest =
        *std::min_element(path.radii.begin(), path.radii.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    const auto& branch = anatomy.branches[target.branch].radii;
    if ((path.points[last] - target.centre).norm() > path.radii[last])
        narrowest =
            std::min(narrowest, *std::min_element(branch.begin(), branch.begin() + target.sample + 1));
    const double room = 0.95 * arcs.back();
    const FirstWire& wire = wire_for(narrowest, room);
    const double inserted =
        std::clamp(std::floor(inserted_fraction * arcs[last]), std::min(wire.least_inserted, arcs.back()),
                   std::max(most_inserted, wire.least_inserted));
    const auto at = std::lower_bound(arcs.begin(), arcs.end(), inserted) - arcs.begin();
    const Vec3 tip = path.points[std::min<std::size_t>(static_cast<std::size_t>(at), path.points.size() - 1)];
    Eigen::AlignedBox3d box(tip);
    box.extend(path.points.front());
    box.extend(target.centre);
    const bool all_in_view = std::max(box.sizes().x(), box.sizes().z()) <= field;
    const Vec3 isocentre = all_in_view ? Vec3(box.center()) : tip;

    std::string text = fmt::format(
        "schema = 1\ntitle = {}\nanatomy = {}\n\n[entry]\nend = {}\ninserted_mm = {}\n\n"
        "[guidewire]\ndevice = \"{}\"{}\n\n[target]\nname = {}\nradius_mm = {}\n\n"
        "[c_arm]\nisocentre_mm = [{}, {}, {}]\n",
        io::toml_text(anatomy.name), io::toml_text(file.string()),
        io::toml_text(anatomy.ends[entry].opening.name), decimal(inserted), wire.name,
        wire.diameter < 2 * narrowest
            ? ""
            : fmt::format("  # does not pass {:.2f} mm, the narrowest place on the way", 2 * narrowest),
        io::toml_text(target.name), decimal(std::clamp(branch[target.sample], 1.0, 5.0)),
        decimal(isocentre.x()), decimal(isocentre.y()), decimal(isocentre.z()));
    if (const std::string obstacle = obstacle_to_field(anatomy, 0.5 * wire.diameter); !obstacle.empty())
        text += fmt::format("\n[wall]\nmodel = \"mesh\"  # no smooth wall: {}\n", obstacle);
    if (!anatomy.body)
        text +=
            "\n[imaging]\npatient = false  # where in a body this is was not said: anatomy import --body\n";
    return text;
}

}  // namespace anatomy
