#pragma once
/// A second way to compute path lengths, with another program's rays, to check the fluoroscope's.

#include <memory>

#include "physics/geometry/vec.h"

namespace studies {

/// A closed mesh, whose triangles Embree intersects.
class AllHits {
public:
    explicit AllHits(geometry::TriangleMesh);
    ~AllHits();

    struct Sum {
        double length = 0;  // inside the mesh [mm]
        int balance = 0;    // entries minus exits
    };
    /// Follows a ray from a place outside in a unit direction. Embree finds in floats which triangles are
    /// met; their planes give in doubles where. A ray through an edge may meet both its triangles: the
    /// balance is then not 0.
    Sum along(const geometry::Vec3& origin, const geometry::Vec3& direction) const;

private:
    struct Scene;
    std::unique_ptr<const Scene> scene_;
};

}  // namespace studies
