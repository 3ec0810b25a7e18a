#pragma once
/// Fewer and better triangles for the surface of a lumen.

#include <functional>

#include "engine/anatomy/grow/implicit_lumen.h"

namespace anatomy {

/// Of an edge across the vessel; sets its length to √(8·r·sagitta) [mm].
inline constexpr double edge_sagitta = 0.025;

/// Merges edges up to the target length, flips them until they are Delaunay, and evens out the corners along
/// the surface, repeatedly. Takes and returns a closed manifold.
geometry::TriangleMesh remeshed(const geometry::TriangleMesh&, const ImplicitLumen&,
                                const std::function<void(double)>& progress = {});

}  // namespace anatomy
