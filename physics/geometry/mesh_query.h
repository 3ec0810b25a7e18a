#pragma once
/// Distances and rays against a triangle mesh that need not be closed.

#include <limits>
#include <memory>

#include "physics/geometry/vec.h"

namespace geometry {

class MeshQuery {
public:
    /// The mesh has triangles and finite corners (asserted); it is copied.
    explicit MeshQuery(const TriangleMesh&);
    MeshQuery(MeshQuery&&) noexcept;
    ~MeshQuery();

    struct Nearest {
        int triangle = -1;                                          // -1: nothing within reach
        double distance = std::numeric_limits<double>::infinity();  // [mm]
    };
    /// The closest triangle no farther than `within` [mm].
    Nearest nearest(const Vec3&, double within = std::numeric_limits<double>::infinity()) const;
    double distance(const Vec3& x) const { return nearest(x).distance; }

    struct Hit {
        double distance = std::numeric_limits<double>::infinity();  // along the ray; infinite for none [mm]
        Vec3 normal = Vec3::Zero();                                 // of the triangle, unit
    };
    /// The first place where a ray in the unit direction meets the mesh, from `start` on [mm].
    Hit hit(const Vec3& origin, const Vec3& direction, double start = 0) const;
    double first_hit(const Vec3& origin, const Vec3& direction, double start = 0) const {
        return hit(origin, direction, start).distance;
    }
    /// Distance beyond a hit at which a ray's next `start` does not find the same hit again [mm].
    double nudge() const;
    /// How often the ray meets the mesh, counted up to `most`.
    int crossings(const Vec3& origin, const Vec3& direction, int most = 8) const;
    /// Whether a closed mesh encloses the point: most of three rays from it cross the mesh an odd number of
    /// times.
    bool encloses(const Vec3&) const;

private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

}  // namespace geometry
