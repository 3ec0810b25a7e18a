#pragma once
/// Surface nets (Gibson 1998): a closed triangle mesh of a level set.

#include <functional>

#include "engine/anatomy/grow/implicit_lumen.h"

namespace anatomy {

/// The lumen's surface with a corner for every cell that it passes through, moved onto f = 0. Closed,
/// oriented outward, every edge shared by two triangles: where the signs at a cell's corners leave the course
/// of the surface ambiguous, corners are counted as inside until it is clear. The result is the same for any
/// number of threads. `progress` runs from 0 to 1.
geometry::TriangleMesh surface_nets(const ImplicitLumen&, int threads,
                                    const std::function<void(double)>& progress = {});

}  // namespace anatomy
