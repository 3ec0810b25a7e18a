#pragma once
/// Surface nets (Gibson 1998): a closed triangle mesh of a level set.

#include <functional>

#include "engine/anatomy/grow/implicit_lumen.h"

namespace anatomy {

/// The lumen's surface, a corner for every cell that it passes through, moved on to f = 0. Closed, outward,
/// every edge of two triangles: where the signs at a cell's corners leave open how the surface runs, corners
/// are counted as inside until they do not. The same for any number of threads. `progress` from 0 to 1.
geometry::TriangleMesh surface_nets(const ImplicitLumen&, int threads,
                                    const std::function<void(double)>& progress = {});

}  // namespace anatomy
