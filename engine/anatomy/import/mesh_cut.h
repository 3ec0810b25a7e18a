#pragma once
/// Opens a closed lumen where a vessel ends blind.

#include "physics/geometry/vec.h"

namespace anatomy {

/// The mesh without the part that lies beyond the plane through `centre` and is connected to the triangle
/// nearest to `apex`; triangles across the plane are cut. Corners close to the plane are moved into it first.
geometry::TriangleMesh cut_beyond(const geometry::TriangleMesh&, const geometry::Vec3& centre,
                                  const geometry::Vec3& outward, const geometry::Vec3& apex);

}  // namespace anatomy
