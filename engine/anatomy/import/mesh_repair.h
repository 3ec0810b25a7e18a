#pragma once
/// Turns a lumen's surface, as scanners and programs produce it, into one that a wall can be built from.

#include <string>
#include <vector>

#include "physics/geometry/mesh_topology.h"

namespace anatomy {

/// One observation about an anatomy.
struct Finding {
    enum class Kind { Noted, Mended, Warned };
    Kind kind = Kind::Noted;
    std::string text;
};
/// "mended: …", "note: …" for a warning, "found: …".
std::string text_of(const Finding&);

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

struct RepairedLumen {
    geometry::TriangleMesh
        mesh;  // welded, outward, manifold, open at the ends only; single-precision corners
    std::vector<MeshOpening> ends;  // largest first
    std::vector<Finding> findings;
};

/// Every opening of an oriented mesh whose boundary visits no corner twice, largest first.
std::vector<MeshOpening> openings_of(const geometry::TriangleMesh&);

/// Welds corners closer than a millionth of the diagonal, drops degenerate and duplicate triangles, fins and
/// islands, turns all triangles outward, fills holes, takes off the flat caps of vessels and smooths the
/// steps of voxels. Throws InputError for a surface without an inside.
RepairedLumen repaired(const geometry::TriangleMesh&);

}  // namespace anatomy
