#pragma once
/// The rims of a lumen at its open ends, led to the planes of these.

#include <span>

#include "physics/geometry/centreline_tree.h"

namespace physics {

using namespace geometry;

/// A mesh that is welded, its triangles facing one way, with every uneven rim led on along its end's axis
/// past the plane: on a mesh from elsewhere the rim does not lie in a plane, and between rim and plane there
/// would be no wall. A rim that is even is left as it is, and a mesh that has no other is returned as it was.
TriangleMesh with_even_rims(const TriangleMesh&, std::span<const OpenEnd>);

}  // namespace physics
