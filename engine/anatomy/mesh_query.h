#pragma once
/// Distances and rays against a triangle mesh that need not be closed.

#include <limits>
#include <memory>

#include "physics/geometry.h"

namespace engine {

class MeshQuery {
public:
    /// The mesh has triangles and finite corners (asserted); it is copied.
    explicit MeshQuery(const physics::TriangleMesh&);
    MeshQuery(MeshQuery&&) noexcept;
    ~MeshQuery();

    struct Nearest {
        int triangle = -1;                                          // -1: nothing within reach
        double distance = std::numeric_limits<double>::infinity();  // [mm]
    };
    /// The closest triangle no farther than `within` [mm].
    Nearest nearest(const physics::Vec3&, double within = std::numeric_limits<double>::infinity()) const;
    double distance(const physics::Vec3& x) const { return nearest(x).distance; }

    /// How far along the unit direction the mesh is first met, from `start` on [mm]; infinite for never.
    double first_hit(const physics::Vec3& origin, const physics::Vec3& direction, double start = 0) const;
    /// How often the mesh is met, at most `most` times.
    int crossings(const physics::Vec3& origin, const physics::Vec3& direction, int most = 8) const;
    /// Of a closed mesh: whether most of three rays from the point cross it an odd number of times.
    bool encloses(const physics::Vec3&) const;

private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

}  // namespace engine
