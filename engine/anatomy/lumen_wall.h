#pragma once
/// The smooth wall of an anatomy, made once and kept on disk.

#include <filesystem>
#include <functional>
#include <memory>

#include "engine/anatomy/anatomy.h"
#include "physics/wall.h"

namespace engine {

/// Where distance fields are kept. A folder that cannot be written to, or an empty path, only means that they
/// are made every time.
struct FieldCache {
    std::filesystem::path folder;
    std::function<void(double)> progress;  // told 0 to 1 while a field is made
};

/// The usual folder: field-cache beside an output file or folder.
std::filesystem::path field_cache_beside(const std::filesystem::path& output);

/// The distance field of an anatomy's lumen for a wire of this radius [mm]; stiffness: k per joint [N/mm].
/// It is read from the cache folder when that holds the field of the same mesh, centrelines and version;
/// else it is made, which takes seconds, and kept there as field-FINGERPRINT.bin. A damaged file is replaced.
/// Throws std::invalid_argument as physics::DistanceField does.
std::unique_ptr<physics::LumenWall> cached_distance_field(const Anatomy&, double stiffness,
                                                          double wire_radius, const FieldCache& = {});

}  // namespace engine
