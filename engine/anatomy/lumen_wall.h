#pragma once
/// The wall of an anatomy. The smooth wall is made once and kept on disk.

#include <memory>
#include <optional>
#include <string>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/model_cache.h"
#include "physics/wall/wall.h"
#include "physics/wall/wall_stiffness.h"

namespace anatomy {

/// k with its variation along the vessels, if there is one: over the longest way from the start of a root
/// vessel to an end where the variation has no length of its own. Throws std::invalid_argument as
/// WallStiffness does.
physics::WallStiffness stiffness_of(const Anatomy&, double stiffness,
                                    const std::optional<physics::WallVariation>&);

/// The smooth field of the mesh, or the mesh's own planes found by ray.
enum class SurfaceWall { DistanceField, Mesh };
/// The wall of an anatomy's lumen for a wire of this radius [mm] and devices around it of up to `thickest`
/// [mm], 0 = none; stiffness: k per joint [N/mm]. Throws std::invalid_argument as physics::DistanceField and
/// physics::MeshWall do.
std::unique_ptr<physics::LumenWall> surface_wall(const Anatomy&, SurfaceWall,
                                                 physics::WallStiffness stiffness, double wire_radius,
                                                 const ModelCache& = {}, double thickest = 0);

/// Why there can be no distance field of this lumen for devices of up to this radius [mm], a clause; empty
/// where there can.
std::string obstacle_to_field(const Anatomy&, double thickest);

/// The distance field of an anatomy's lumen, as surface_wall. It is as deep as the thickest device needs.
/// Read from the cache folder when that holds the field of the same mesh, centrelines, depth and version;
/// else made, which takes seconds, and stored there as field-FINGERPRINT.bin. A damaged file is replaced.
/// Throws std::invalid_argument as physics::DistanceField does.
std::unique_ptr<physics::LumenWall> cached_distance_field(const Anatomy&,
                                                          const physics::WallStiffness& stiffness,
                                                          double wire_radius, const ModelCache& = {},
                                                          double thickest = 0);

/// What DistanceField::packed() has of the field of this anatomy that the cache has under this name, made
/// anew; nothing where no depth of fields gives the name.
std::optional<std::string> packed_distance_field(const Anatomy&, const std::string& file_name);

}  // namespace anatomy
