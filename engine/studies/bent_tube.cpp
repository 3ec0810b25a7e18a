#include "engine/studies/bent_tube.h"

#include <algorithm>
#include <cmath>

namespace studies {

using geometry::Mat3;
using geometry::Vec3;

physics::WallContact BentTube::contact(const Vec3& x) const {
    // Seen from the centre of the bend: the angle along it, and outwards.
    const Vec3 from(x.x(), x.y() - bend_, 0);
    const double along = std::atan2(from.x(), -from.y());
    const double before = -0.5 * (2 * M_PI - angle_);  // beyond this angle the far end is nearer
    const double on = along < before ? angle_ : std::clamp(along, 0.0, angle_);
    const Vec3 outwards(std::sin(on), -std::cos(on), 0), forwards(std::cos(on), std::sin(on), 0);
    const Vec3 out = x - (Vec3(0, bend_, 0) + bend_ * outwards);
    const double distance = out.norm();
    physics::WallContact c;
    c.penetration = distance - radius_;
    c.clearance = radius_;
    c.trust = std::max(0.0, -c.penetration);
    c.stiffness = stiffness_;
    c.station = 0;
    if (distance < 1e-12) return c;
    c.normal = out / distance;
    if (on != along) {
        c.curvature = (Mat3::Identity() - c.normal * c.normal.transpose()) / distance;
    } else {
        const Vec3 around = c.normal.cross(forwards);
        c.curvature = around * around.transpose() / distance +
                      c.normal.dot(outwards) / from.norm() * forwards * forwards.transpose();
    }
    return c;
}

void BentTube::rigid_contacts(std::span<const Vec3> joints, std::span<physics::WallContact> contacts) const {
    physics::require_finite(joints);
    for (std::size_t i = 0; i < joints.size(); ++i) contacts[i] = contact(joints[i]);
}

}  // namespace studies
