#pragma once
/// The middle of a vessel near a rough path through it, and the radius of the lumen there.

#include <vector>

#include "physics/geometry/mesh_query.h"

namespace anatomy {

struct Centreline {
    geometry::Polyline points;  // equally far apart [mm]
    std::vector<double> radii;  // of the inscribed ball [mm]
};

std::vector<double> inscribed_radii(const geometry::Polyline&, const geometry::MeshQuery& wall);

/// Moves the points of a path inside the lumen to the centroids of its cross-sections. A cross-section is
/// what a fan of rays in the normal plane reaches, none counted farther than 1.4 times their median, so that
/// side branches do not draw the path in. A fixed end stays where it is.
Centreline recentred(const geometry::Polyline& rough, const geometry::MeshQuery& wall, double step,
                     bool fixed_start, bool fixed_end);

}  // namespace anatomy
