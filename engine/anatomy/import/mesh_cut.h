#pragma once
/// Opens a closed lumen where vessels end blind.

#include <unordered_map>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

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

}  // namespace anatomy
