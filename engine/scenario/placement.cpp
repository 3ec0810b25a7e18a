#include "engine/scenario/placement.h"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/model_cache.h"
#include "engine/anatomy/organs.h"
#include "engine/io/text.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/polyline.h"
#include "physics/wall/tube_wall.h"

namespace scenario {

using geometry::Vec3;

ModelChoice choose(Scenario& s, const anatomy::Anatomy& anatomy, const Reach& reach) {
    // A wire may wander wherever it fits and its length goes; nothing else can ever bend it.
    LumenDemand within = reach.all();
    if (const std::optional<int> end = anatomy::find_end(anatomy, s.entry.end)) {
        double longest = 0, thinnest = std::numeric_limits<double>::infinity();
        for (const PlacedDevice& placed : s.devices) {
            longest = std::max(longest, placed.device.length);
            thinnest = std::min(thinnest, placed.device.outer_diameter);
        }
        within = reach.within(anatomy.ends[*end].opening, longest, thinnest);
    }
    ModelChoice choice = choose_model(anatomy, reach, within, s.wire().device, s.refinement.curve_tolerance,
                                      s.tube.has_value(), s.thickest_radius());
    if (s.wall_model == WallModel::Auto && choice.wall == WallModel::Auto)
        throw io::InputError(
            io::located(s.place("wall.model"),
                        fmt::format("no distance field of this lumen can be made: {}; expected model = "
                                    "\"mesh\" under [wall]: planes, on which frames need not end at rest",
                                    choice.wall_reason)));
    if (s.wall_model == WallModel::Auto) s.wall_model = choice.wall;
    if (s.choose_segment_length) {
        s.wall_stiffness *= choice.segment_length / s.segment_length;  // the same per length of wire
        s.segment_length = choice.segment_length;
    }
    return choice;
}

anatomy::EntryPath entry_of(const Scenario& s, const anatomy::Anatomy& anatomy) {
    const std::optional<int> end = anatomy::find_end(anatomy, s.entry.end);
    if (!end) {
        std::vector<std::string> names;
        for (const anatomy::VesselEnd& known : anatomy.ends) names.push_back(known.opening.name);
        throw io::InputError(
            io::located(s.place("entry.end"), fmt::format("'{}' is no open end of {}; ends are: {}",
                                                          s.entry.end, anatomy.name, io::joined(names))));
    }
    anatomy::EntryPath entry = anatomy::path_from(anatomy, *end);

    const std::vector<double> arcs = geometry::arc_lengths(entry.points);
    const double length = arcs.back();
    for (const PlacedDevice& placed : s.devices) {
        if (!placed.starts_inside()) continue;
        const double thickness = placed.device.outer_diameter;
        double narrowest = entry.radii.front();
        for (std::size_t i = 1; i < arcs.size() && arcs[i - 1] < placed.inserted; ++i)
            narrowest = std::min(narrowest, entry.radii[i]);
        if (!physics::enters(thickness, narrowest))
            throw io::InputError(io::located(
                s.place_of(placed, "diameter_mm"),
                fmt::format("a {0} of diameter {1} mm does not enter at '{2}', which is {3:.3g} mm wide as "
                            "far as {4:g} mm of it start inside; expected a thinner {0}",
                            placed.name(), thickness, s.entry.end, 2 * narrowest, placed.inserted)));
        if (placed.inserted > length + 1e-6 && placed.role != script::DeviceRole::Wire)
            throw io::InputError(io::located(
                s.place_of(placed, "inserted_mm"),
                fmt::format("{:g} mm of a {} cannot start inside; the way from '{}' is {:.4g} mm long",
                            placed.inserted, placed.name(), s.entry.end, length)));
    }
    const double least = physics::least_length({s.segment_length}), inserted = s.wire().inserted;
    if (inserted < least * (1 - 1e-9) || inserted > length + 1e-6) {
        throw io::InputError(io::located(s.place("entry.inserted_mm"),
                                         fmt::format("{} mm of wire cannot start inside; expected {} mm (two "
                                                     "segments) to {:.4g} mm (the way from '{}')",
                                                     inserted, least, length, s.entry.end)));
    }
    return entry;
}

Vec3 target_of(const Scenario& s, const anatomy::Anatomy& anatomy) {
    if (s.target.centre) {
        if (anatomy::inside(anatomy, *s.target.centre)) return *s.target.centre;
        const anatomy::VesselPlace place = anatomy::nearest_place(anatomy, *s.target.centre);
        throw io::InputError(io::located(s.place("target.centre_mm"),
                                         fmt::format("the target is outside the anatomy, {:.3g} mm from the "
                                                     "wall of '{}'; expected a place inside a vessel",
                                                     place.distance, anatomy.branches[place.branch].name)));
    }
    std::vector<std::string> names;
    for (const anatomy::VesselTarget& known : anatomy.targets) {
        if (known.name == s.target.name) return known.centre;
        names.push_back(known.name);
    }
    throw io::InputError(
        io::located(s.place("target.name"), fmt::format("'{}' is no target of {}; targets are: {}",
                                                        s.target.name, anatomy.name, io::joined(names))));
}

namespace {

/// Of all that a wall on the surface of a lumen is made from.
std::uint64_t key_of(const anatomy::Anatomy& anatomy, anatomy::SurfaceWall kind,
                     const physics::WallStiffness& stiffness, const std::vector<physics::Tissue>& tissues,
                     double wire_radius, double thickest) {
    geometry::Hash hash;
    const auto add_all = [&hash](const auto& list) {
        hash.add(std::uint64_t{list.size()});
        hash.add(list.data(), list.size() * sizeof list[0]);
    };
    hash.add(static_cast<std::uint64_t>(kind));
    hash.add(stiffness.mean());
    hash.add(stiffness.length());
    hash.add(stiffness.joint_length());
    add_all(stiffness.terms());
    add_all(tissues);
    hash.add(wire_radius);
    hash.add(thickest);
    add_all(anatomy.lumen.vertices);
    add_all(anatomy.lumen.triangles);
    hash.add(std::uint64_t{anatomy.branches.size()});
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        hash.add(static_cast<std::uint64_t>(branch.parent));
        hash.add(static_cast<std::uint64_t>(branch.parent_sample));
        add_all(branch.name);
        add_all(branch.points);
        add_all(branch.radii);
    }
    for (const geometry::OpenEnd& end : anatomy.openings()) {
        add_all(end.name);
        hash.add(end.centre.data(), sizeof(double) * 3);
        hash.add(end.outward_normal.data(), sizeof(double) * 3);
        hash.add(end.radius);
        hash.add(static_cast<std::uint64_t>(end.goes_on));
        hash.add(end.bore);
        hash.add(end.length);
        hash.add(end.faces.data(), sizeof(double) * 3);
    }
    return hash.value();
}

}  // namespace

bool vessels_move(const Scenario& s) {
    return s.tissue.rigid ? !*s.tissue.rigid : could_move(s);
}

bool could_move(const Scenario& s) {
    return !s.tube && s.wall_model == WallModel::DistanceField &&
           s.relaxer.kind == physics::RelaxerKind::Global;
}

std::vector<physics::Tissue> tissues_of(const Scenario& s, const anatomy::Anatomy& anatomy) {
    return vessels_move(s) ? tissues_that_could_move(s, anatomy) : std::vector<physics::Tissue>();
}

std::vector<physics::Tissue> tissues_that_could_move(const Scenario& s, const anatomy::Anatomy& anatomy) {
    if (!vessels_move(s) && !could_move(s)) return {};
    const TissueChoice& choice = s.tissue;
    std::vector<physics::Tissue> tissues = anatomy::tissues_of(anatomy);
    const auto change = [](physics::Tissue& tissue, const TissueChoice::Values& by) {
        tissue.modulus = by.modulus.value_or(tissue.modulus);
        tissue.wall = by.wall.value_or(tissue.wall);
    };
    for (physics::Tissue& tissue : tissues) change(tissue, choice.all);
    for (const TissueChoice::Values& values : choice.vessels) {
        const auto branch =
            std::ranges::find_if(anatomy.branches, [&](const auto& b) { return b.name == values.vessel; });
        if (branch == anatomy.branches.end()) {
            std::vector<std::string> names;
            for (const auto& b : anatomy.branches) names.push_back(b.name);
            throw io::InputError(io::located(
                s.place("tissue"), fmt::format("[[tissue.vessel]] '{}' is no vessel of {}; vessels are: {}",
                                               values.vessel, anatomy.name, io::joined(names))));
        }
        change(tissues[static_cast<std::size_t>(branch - anatomy.branches.begin())], values);
    }
    return tissues;
}

std::shared_ptr<const physics::LumenWall> wall_of(const Scenario& s, const anatomy::Anatomy& anatomy,
                                                  const anatomy::ModelCache& cache) {
    static anatomy::SharedStore<std::uint64_t, physics::LumenWall> walls;
    const double wire_radius = 0.5 * s.wire().device.outer_diameter;
    const physics::WallStiffness stiffness =
        anatomy::stiffness_of(anatomy, s.wall_stiffness, s.wall_variation).per(s.segment_length);
    const std::vector<physics::Tissue> tissues = tissues_of(s, anatomy);
    const auto in_tissue = [&](std::shared_ptr<physics::LumenWall> wall) {
        if (!tissues.empty()) {
            const auto ends = anatomy.openings();
            wall->lie_in(std::make_shared<physics::Foundation>(anatomy.branches, tissues, ends));
        }
        return wall;
    };
    if (s.wall_model == WallModel::Analytic)
        return in_tissue(std::make_shared<physics::TubeWall>(anatomy.branches[0].points, s.tube->radius,
                                                             stiffness, wire_radius, anatomy.openings()));
    const auto kind =
        s.wall_model == WallModel::Mesh ? anatomy::SurfaceWall::Mesh : anatomy::SurfaceWall::DistanceField;
    const double thickest = s.thickest_radius();
    return walls.get(
        key_of(anatomy, kind, stiffness, tissues, wire_radius, thickest),
        [&]() -> std::shared_ptr<const physics::LumenWall> {
            return in_tissue(anatomy::surface_wall(anatomy, kind, stiffness, wire_radius, cache, thickest));
        });
}

}  // namespace scenario
