#pragma once
/// Flat caps: programs such as SimVascular, VMTK and CAD close a lumen by a planar patch where a vessel was
/// cut.

#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

/// A planar patch of a surface with a sharp rim, round enough to close a vessel.
struct FlatCap {
    std::vector<int> triangles;
    geometry::Vec3 centre = geometry::Vec3::Zero();  // of its rim [mm]
    geometry::Vec3 normal = geometry::Vec3::Zero();  // out of the lumen, unit
    double radius = 0;                               // mean distance of the rim from its centre [mm]
};

/// The flat caps of a manifold surface that faces outward, in the order of their first triangle. The lumen
/// just behind a cap is as wide as the cap, which the facet of a coarse vessel or the side of a box is not.
///
std::vector<FlatCap> flat_caps(const geometry::TriangleMesh&);

}  // namespace anatomy
