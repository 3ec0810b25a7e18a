#pragma once
/// A lumen's triangles prepared for signed distances: welded, oriented consistently outward, with the normals
/// that decide the side of a point whose closest feature is an edge or a corner.

#include <cstdint>

#include "physics/geometry/vec.h"

namespace geometry {

/// Closest point of a triangle, and the feature it lies on.
struct TrianglePoint {
    Vec3 point = Vec3::Zero();
    double square_distance = 0;  // [mm²]
    int feature = 0;             // 0–2: corner k; 3–5: edge from corner k-3 to the next; 6: the face
};
TrianglePoint closest_point(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x);

class LumenSurface {
public:
    /// Vertices with equal coordinates become one; triangles without area are dropped; triangles that
    /// disagree with their neighbours are turned, so that a mesh with some or all triangles flipped gives the
    /// same surface. `inward` maps a triangle's centroid to a point inside the lumen: each connected part is
    /// made to face away from it, by a vote weighted by area. Throws std::invalid_argument when no triangle
    /// is left, a number is not finite or an index is out of range.
    template <class Inward>
    LumenSurface(const TriangleMesh& mesh, const Inward& inward) : LumenSurface(mesh) {
        std::vector<double> vote(parts_, 0.0);
        for (int t = 0; t < count(); ++t)
            vote[part_[t]] += area_normal(t).dot(centroid(t) - inward(centroid(t)));
        face_out(vote);
    }

    int count() const { return static_cast<int>(mesh_.triangles.size()); }
    const TriangleMesh& mesh() const { return mesh_; }
    const Vec3& corner(int triangle, int k) const { return mesh_.vertices[mesh_.triangles[triangle][k]]; }
    Vec3 centroid(int t) const { return (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3; }
    /// A sphere around the centroid that holds the triangle [mm].
    struct Sphere {
        Vec3 centre;
        double radius;
    };
    const Sphere& sphere(int t) const { return spheres_[t]; }
    Vec3 area_normal(int t) const {
        return 0.5 * (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
    }

    /// Least cosine of the angles between a triangle's normal and those over its edges.
    double flatness(int t) const;

    /// Normal of a feature, of any length: a face's own, for an edge the sum of its two faces' normals, for a
    /// corner their sum weighted by angle (Bærentzen and Aanæs 2005). The sign of its product with x - point
    /// gives the side of x.
    Vec3 pseudo_normal(int triangle, int feature) const;

private:
    explicit LumenSurface(const TriangleMesh&);
    void face_out(const std::vector<double>& vote);

    TriangleMesh mesh_;
    std::vector<std::array<int, 3>> across_;  // triangle over the edge from corner k to the next, -1 at a rim
    std::vector<int> part_;                   // connected part of each triangle
    int parts_ = 0;
    std::vector<Sphere> spheres_;       // around each triangle, a little larger than need be
    std::vector<Vec3> normals_;         // of the triangles, unit
    std::vector<Vec3> corner_normals_;  // per vertex
};

}  // namespace geometry
