#pragma once
/// Cuts the ends of a lumen open.

#include <span>

#include "engine/anatomy/grow/implicit_lumen.h"

namespace anatomy {

struct EndCut {
    geometry::Vec3 centre, outward;  // of the plane; outward is a unit vector
    geometry::Vec3 beyond;           // a point on the axis inside the part to be cut off [mm]
};

/// The mesh without the parts beyond each plane, bounded by loops in the planes. Corners near a plane are
/// moved into it along the surface, to avoid sharp triangles. Throws InputError when the part beyond a plane
/// cannot be distinguished from the rest.
geometry::TriangleMesh cut_open(const geometry::TriangleMesh&, const ImplicitLumen&, std::span<const EndCut>);

}  // namespace anatomy
