#pragma once
/// A second way to path lengths, through another program's rays: what the fluoroscope's are held against.

#include <memory>

#include "physics/geometry/vec.h"

namespace studies {

/// A closed mesh, as Embree meets its triangles.
class AllHits {
public:
    explicit AllHits(geometry::TriangleMesh);
    ~AllHits();
    AllHits(AllHits&&) noexcept;

    struct Sum {
        double length = 0;  // inside the mesh [mm]
        int balance = 0;    // entries less exits
    };
    /// From a place outside in a unit direction. Which triangles are met Embree says, in floats; where, their
    /// planes in doubles. A ray through an edge may meet both its triangles: then the balance is not 0.
    Sum along(const geometry::Vec3& origin, const geometry::Vec3& direction) const;

private:
    struct Scene;
    std::unique_ptr<const Scene> scene_;
};

}  // namespace studies
