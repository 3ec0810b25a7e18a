#pragma once
/// Opening a closed lumen where a vessel ends blind.

#include "physics/geometry.h"

namespace engine {

/// The mesh without what lies beyond the plane through `centre` and hangs together with the triangle nearest
/// to `apex`; triangles across the plane are cut. Corners close to the plane are moved into it first.
physics::TriangleMesh cut_beyond(const physics::TriangleMesh&, const physics::Vec3& centre,
                                 const physics::Vec3& outward, const physics::Vec3& apex);

}  // namespace engine
