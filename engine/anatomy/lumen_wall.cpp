#include "engine/anatomy/lumen_wall.h"

#include <algorithm>
#include <fmt/format.h>
#include <sstream>
#include <thread>

#include "physics/geometry/mapped_file.h"
#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"

namespace anatomy {
namespace {

/// Cells of the grid from a wall to the axis: with fewer the field does not separate its sides. In tubes with
/// this many it is off by 0.03 mm at 1 % of the places near the wall, with two by 0.01 mm at most.
constexpr double cells_to_axis = 1.25;

/// For devices of up to this radius.
physics::DistanceFieldOptions field_options(double thickest) {
    physics::DistanceFieldOptions options;
    options.inner = physics::DistanceField::depth_for(thickest);
    options.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
    return options;
}
std::string field_name(std::uint64_t fingerprint) {
    return fmt::format("field-{:016x}.bin", fingerprint);
}

}  // namespace

physics::WallStiffness stiffness_of(const Anatomy& anatomy, double stiffness,
                                    const std::optional<physics::WallVariation>& variation) {
    if (!variation) return stiffness;
    return variation->of(stiffness, geometry::CentrelineTree(anatomy.branches, {}).longest_arc());
}

std::unique_ptr<physics::LumenWall> surface_wall(const Anatomy& anatomy, SurfaceWall kind,
                                                 physics::WallStiffness stiffness, double wire_radius,
                                                 const ModelCache& cache, double thickest) {
    if (kind == SurfaceWall::DistanceField)
        return cached_distance_field(anatomy, stiffness, wire_radius, cache, thickest);
    return std::make_unique<physics::MeshWall>(anatomy.lumen, anatomy.branches, anatomy.openings(),
                                               std::move(stiffness), wire_radius);
}

std::string obstacle_to_field(const Anatomy& anatomy, double thickest) {
    physics::DistanceFieldOptions options;
    options.inner = physics::DistanceField::depth_for(thickest);
    const auto [spacing, bytes, bytes_while] = physics::DistanceField::estimate(anatomy.branches, options);
    for (const CentrelineBranch& branch : anatomy.branches)
        if (const double least = *std::ranges::min_element(branch.radii); least < cells_to_axis * spacing)
            return fmt::format("a grid of {:.2g} mm does not resolve '{}' of radius {:.3g} mm", spacing,
                               branch.name, least);
    const double most = static_cast<double>(options.largest);
    if (bytes_while <= most) return {};
    return fmt::format("making one of {:g} mm depth would take {:.0f} MB, more than {:.0f} MB", options.inner,
                       bytes_while / 1e6, most / 1e6);
}

std::unique_ptr<physics::LumenWall> cached_distance_field(const Anatomy& anatomy,
                                                          const physics::WallStiffness& stiffness,
                                                          double wire_radius, const ModelCache& cache,
                                                          double thickest) {
    const physics::DistanceFieldOptions options = field_options(std::max(wire_radius, thickest));
    const auto ends = anatomy.openings();
    const auto fingerprint =
        physics::DistanceField::fingerprint(anatomy.lumen, anatomy.branches, ends, options);
    const CachePlace place(cache, field_name(fingerprint));
    if (place.exists()) {
        if (const auto file = geometry::MappedFile::of(place.path())) {
            try {
                place.used();
                return std::make_unique<physics::DistanceField>(physics::DistanceField::load(
                    file->bytes(), file, fingerprint, anatomy.branches, ends, stiffness, wire_radius));
            } catch (const std::runtime_error&) {
                // Damaged or of another version: made anew below and overwritten.
            }
        }
    }
    std::function<void(double)> progress;
    if (cache.progress) progress = [&](double part) { cache.progress(part, "distance field"); };
    count(Made::Field);
    auto field = std::make_unique<physics::DistanceField>(anatomy.lumen, anatomy.branches, ends, stiffness,
                                                          wire_radius, options, progress);
    if (place.exists()) {
        std::ostringstream bytes;
        field->save(bytes);
        place.keep_file(std::move(bytes).str());
    }
    return field;
}

std::optional<std::string> packed_distance_field(const Anatomy& anatomy, const std::string& file_name) {
    constexpr double thickest_of_all = 6;  // far more than a device [mm]
    const auto ends = anatomy.openings();
    double radius = 0;
    while (radius < thickest_of_all) {
        physics::DistanceFieldOptions options = field_options(radius);
        radius = options.inner;
        const auto fingerprint =
            physics::DistanceField::fingerprint(anatomy.lumen, anatomy.branches, ends, options);
        if (field_name(fingerprint) != file_name) continue;
        options.packable = true;
        return physics::DistanceField(anatomy.lumen, anatomy.branches, ends, 1.0, 0.0, options).packed();
    }
    return std::nullopt;
}

}  // namespace anatomy
