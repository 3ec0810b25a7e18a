#pragma once
/// Fewer and better triangles for the surface of a lumen.

#include <functional>

#include "engine/anatomy/grow/implicit_lumen.h"

namespace anatomy {

struct RemeshOptions {
    double sagitta = 0.025;    // of an edge across the vessel; sets its length to √(8·r·sagitta) [mm]
    double deviation = 0.045;  // of a triangle's centroid from f = 0 that no collapse may exceed [mm]
};

/// Merges edges up to the target length, flips them until they are Delaunay, and evens out the corners along
/// the surface, repeatedly. Takes and returns a closed manifold.
geometry::TriangleMesh remeshed(const geometry::TriangleMesh&, const ImplicitLumen&,
                                const RemeshOptions& = {}, const std::function<void(double)>& progress = {});

}  // namespace anatomy
