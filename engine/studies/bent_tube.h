#pragma once
/// A tube of constant radius around an arc, closed by half balls, in closed form and without the corners of a
/// polyline.

#include "physics/wall/wall.h"

namespace studies {

class BentTube final : public physics::LumenWall {
public:
    /// The axis leaves the origin along +x and bends to +y by `angle` < π at `bend` mm; k per joint [N/mm].
    BentTube(double bend, double angle, double radius, double stiffness)
        : bend_(bend), angle_(angle), radius_(radius), stiffness_(stiffness) {}

    void rigid_contacts(std::span<const geometry::Vec3> joints,
                        std::span<physics::WallContact> contacts) const override;

private:
    physics::WallContact contact(const geometry::Vec3& joint) const;

    double bend_, angle_, radius_, stiffness_;
};

}  // namespace studies
