#include "engine/anatomy/lumen_wall.h"

#include <algorithm>
#include <fmt/format.h>
#include <fstream>
#include <sstream>
#include <thread>

#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"

namespace anatomy {

physics::WallStiffness stiffness_of(const Anatomy& anatomy, double stiffness,
                                    const std::optional<physics::WallVariation>& variation) {
    if (!variation) return stiffness;
    return variation->of(stiffness, geometry::CentrelineTree(anatomy.branches, {}).longest_way());
}

std::unique_ptr<physics::LumenWall> surface_wall(const Anatomy& anatomy, SurfaceWall kind,
                                                 physics::WallStiffness stiffness, double wire_radius,
                                                 const ModelCache& cache) {
    if (kind == SurfaceWall::DistanceField)
        return cached_distance_field(anatomy, stiffness, wire_radius, cache);
    return std::make_unique<physics::MeshWall>(anatomy.lumen, anatomy.branches, anatomy.openings(),
                                               std::move(stiffness), wire_radius);
}

std::unique_ptr<physics::LumenWall> cached_distance_field(const Anatomy& anatomy,
                                                          const physics::WallStiffness& stiffness,
                                                          double wire_radius, const ModelCache& cache) {
    physics::DistanceFieldOptions options;
    options.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
    const auto ends = anatomy.openings();
    const auto fingerprint =
        physics::DistanceField::fingerprint(anatomy.lumen, anatomy.branches, ends, options);
    const CachePlace place(cache, fmt::format("field-{:016x}.bin", fingerprint));
    if (place.exists()) {
        std::error_code ignored;
        if (std::ifstream in; std::filesystem::is_regular_file(place.path(), ignored) &&
                              (in.open(place.path(), std::ios::binary), in.is_open())) {
            try {
                place.used();
                return std::make_unique<physics::DistanceField>(physics::DistanceField::load(
                    in, fingerprint, anatomy.branches, ends, stiffness, wire_radius));
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
        place.keep_file(bytes.view());
    }
    return field;
}

}  // namespace anatomy
