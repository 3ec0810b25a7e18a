#pragma once
/// The openings of a lumen's surface, and which of them are ends of vessels.

#include <vector>

#include "physics/geometry/mesh_topology.h"

namespace anatomy {

/// An opening of the surface, with the lumen behind it.
struct MeshOpening {
    geometry::BoundaryLoop loop;
    geometry::Vec3 normal;  // of its plane, out of the lumen; unit
    double radius = 0;      // mean distance of the rim from its centroid [mm]
    double uneven = 0;      // root mean square distance of the rim from its plane [mm]
    double inscribed = 0;   // largest ball that fits in the lumen close behind it [mm]

    /// Whether a vessel ends here; otherwise a piece of its wall is missing.
    bool is_end() const {
        return loop.vertices.size() > 3 && radius >= 0.6 * inscribed && inscribed >= 0.15 * radius &&
               uneven <= 0.2 * radius;
    }
};

/// The boundary of an oriented mesh as loops that visit no corner twice.
std::vector<geometry::BoundaryLoop> simple_loops(const geometry::TriangleMesh&);

/// The openings that these loops of an oriented mesh bound; no loop visits a corner twice.
std::vector<MeshOpening> openings_at(const geometry::TriangleMesh&,
                                     const std::vector<geometry::BoundaryLoop>&);

/// Every opening of an oriented mesh whose boundary visits no corner twice, largest first.
std::vector<MeshOpening> openings_of(const geometry::TriangleMesh&);

}  // namespace anatomy
