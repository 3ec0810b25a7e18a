#pragma once
/// The smooth wall of an anatomy, made once and kept on disk.

#include <memory>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/model_cache.h"
#include "physics/wall/wall.h"
#include "physics/wall/wall_stiffness.h"

namespace anatomy {

/// The distance field of an anatomy's lumen for a wire of this radius [mm]; stiffness: k per joint [N/mm].
/// It is read from the cache folder when that holds the field of the same mesh, centrelines and version;
/// else it is made, which takes seconds, and kept there as field-FINGERPRINT.bin. A damaged file is replaced.
/// Throws std::invalid_argument as physics::DistanceField does.
std::unique_ptr<physics::LumenWall> cached_distance_field(const Anatomy&,
                                                          const physics::WallStiffness& stiffness,
                                                          double wire_radius, const ModelCache& = {});

}  // namespace anatomy
