#pragma once
/// The wall of a triangulated lumen, found as in the paper: a ray from the vessel's centreline out through
/// the joint meets a triangle, whose plane is the wall there. Embree finds the triangle; the plane is rebuilt
/// from the mesh's double-precision vertices.

#include <memory>

#include "physics/geometry/centreline_tree.h"
#include "physics/wall/wall.h"
#include "physics/wall/wall_stiffness.h"

namespace physics {

class MeshWall final : public LumenWall {
public:
    /// The mesh's normals point out of the lumen. stiffness: k per joint [N/mm].
    /// Throws std::invalid_argument for an empty mesh, indices out of range, non-finite numbers or no
    /// centreline.
    MeshWall(const TriangleMesh& lumen, std::vector<CentrelineBranch> branches, std::vector<OpenEnd> ends,
             WallStiffness stiffness, double wire_radius = 0.0);
    ~MeshWall() override;

    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override;
    bool same_vessel(int station, int other) const override;
    void apply_stiffness(const Vec3&, WallContact&) const override;
    bool smooth() const override { return false; }

    /// Branch that a station belongs to, and its sample there.
    struct Place {
        int branch = -1, sample = -1;
    };
    Place place(int station) const;

private:
    struct Scene;
    std::unique_ptr<const Scene> scene_;
};

}  // namespace physics
