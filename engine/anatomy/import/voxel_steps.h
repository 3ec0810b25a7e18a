#pragma once
/// Surfaces made of the steps of voxels, as some programs write what they segment.

#include "physics/geometry/vec.h"

namespace anatomy {

/// Whether most of the surface lies along the axes, as that of voxels does, and not along one of them only,
/// as that of a flat vessel may.
bool is_made_of_steps(const geometry::TriangleMesh&);

/// Smooths a surface without shrinking it, each corner towards its neighbours and back (Taubin 1995); a rim
/// stays where it is.
void smooth(geometry::TriangleMesh&, int rounds = 8);

}  // namespace anatomy
