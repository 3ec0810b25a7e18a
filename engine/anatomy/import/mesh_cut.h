#pragma once
/// The openings of a lumen's surface, and which of them are ends of vessels; opens a closed lumen where
/// vessels end blind.

#include <algorithm>
#include <array>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/vec.h"

namespace anatomy {

/// The triangles on every edge, edges in order.
struct EdgeUses {
    struct Use {
        int low, high, triangle;
        bool forward;  // the triangle runs from low to high
    };
    std::vector<Use> uses;

    explicit EdgeUses(const std::vector<std::array<int, 3>>& triangles) {
        uses.reserve(3 * triangles.size());
        for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
            for (int k = 0; k < 3; ++k) {
                const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
                uses.push_back({std::min(a, b), std::max(a, b), t, a < b});
            }
        }
        std::ranges::sort(uses, [](const Use& p, const Use& q) {
            return std::tie(p.low, p.high, p.triangle) < std::tie(q.low, q.high, q.triangle);
        });
    }
    /// Calls visit(first, last) for the uses of every edge.
    template <class Visit>
    void each(Visit visit) const {
        for (std::size_t i = 0, j; i < uses.size(); i = j) {
            for (j = i + 1; j < uses.size() && uses[j].low == uses[i].low && uses[j].high == uses[i].high;)
                ++j;
            visit(uses.data() + i, uses.data() + j);
        }
    }
};

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

/// Cuts pieces off a manifold mesh. The time of a cut depends on the piece, not on the mesh.
class MeshCut {
public:
    explicit MeshCut(geometry::TriangleMesh);

    /// Takes off the part that lies beyond the plane through `centre` and is connected to the triangle
    /// nearest to `apex`; triangles across the plane are cut, corners close to it are moved into it. Returns
    /// false, and leaves the mesh as it was, when the part extends farther than `reach` from the centre or
    /// its rim farther than `rim_reach` [mm], when it has an opening already, or when the cut would not leave
    /// one opening.
    bool beyond(const geometry::Vec3& centre, const geometry::Vec3& outward, const geometry::Vec3& apex,
                double reach, double rim_reach);

    /// The mesh that is left; corners in single precision.
    geometry::TriangleMesh result() const;

private:
    using Triangle = std::array<int, 3>;
    struct Plane {
        geometry::Vec3 centre, outward;
        std::unordered_map<int, geometry::Vec3> moved;  // corners in the plane, with their places before
    };
    double past(const Plane&, int vertex) const;  // the plane [mm]
    std::vector<int> piece(const Plane&, const geometry::Vec3& apex, double reach) const;
    bool has_an_opening(const Plane&, const std::vector<int>& piece) const;
    bool leaves_one_opening(const Plane&, const std::vector<int>& piece,
                            const std::vector<Triangle>& kept) const;
    void move_near_corners(Plane&, const std::vector<int>& triangles);

    geometry::TriangleMesh mesh_;
    std::vector<std::vector<int>> at_corner_;
    std::vector<char> gone_;
};

/// A planar patch of a surface with a sharp rim, round enough to close a vessel.
struct FlatCap {
    std::vector<int> triangles;
    geometry::Vec3 centre = geometry::Vec3::Zero();  // of its rim [mm]
    geometry::Vec3 normal = geometry::Vec3::Zero();  // out of the lumen, unit
    double radius = 0;                               // mean distance of the rim from its centre [mm]
};

/// The flat caps of a manifold surface that faces outward, in the order of their first triangle. The lumen
/// just behind a cap is as wide as the cap, which the facet of a coarse vessel or the side of a box is not.
///
std::vector<FlatCap> flat_caps(const geometry::TriangleMesh&);

}  // namespace anatomy
