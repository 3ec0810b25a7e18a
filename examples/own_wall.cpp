/// A wall of one's own: a cone that narrows, and the two checks that any wall should pass. The solver needs
/// of it the depth of a joint, its gradient and its second derivative; where they disagree, Newton's method
/// stalls.

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "physics/relax/hub.h"

using namespace physics;

/// About the x axis, of radius `wide` at x = 0, which falls by `slope` per mm.
class Cone final : public LumenWall {
public:
    Cone(double wide, double slope, double stiffness, double wire_radius)
        : wide_(wide),
          cosine_(1 / std::hypot(1.0, slope)),
          sine_(slope * cosine_),
          stiffness_(stiffness),
          wire_radius_(wire_radius) {}

    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        require_finite(joints);
        for (std::size_t i = 0; i < joints.size(); ++i) {
            WallContact& c = contacts[i];
            const Vec3 across(0, joints[i].y(), joints[i].z());
            const double distance = std::max(across.norm(), 1e-9);
            const Vec3 outward = across / distance;
            const double radius = wire_radius_ + c.thickness;
            // The distance to the cone's surface, outward.
            c.penetration = (distance - wide_) * cosine_ + joints[i].x() * sine_ + radius;
            c.normal = cosine_ * outward + sine_ * Vec3::UnitX();
            c.curvature = cosine_ / distance *
                          (Mat3::Identity() - outward * outward.transpose() -
                           Vec3::UnitX() * Vec3::UnitX().transpose());
            c.stiffness = stiffness_ * c.fraction;
            c.stiffening = Vec3::Zero();
            c.trust = std::max(0.0, -c.penetration);  // it is a distance: nothing nearer is touched
            c.clearance = std::max(0.1, wide_ - joints[i].x() * sine_ / cosine_ - radius);
            c.station = 0;
        }
    }

private:
    double wide_, cosine_, sine_, stiffness_, wire_radius_;
};

WallContact ask(const LumenWall& wall, const Vec3& x) {
    WallContact contact;
    wall.contacts(std::span(&x, 1), std::span(&contact, 1));
    return contact;
}

int main() {
    Device wire;
    wire.spec.sections = soft_tip(6, 30, 40, 250);
    wire.inserted = 30;
    const Cone wall(4, 0.04, 5, wire.spec.outer_diameter / 2);

    // Gradient and curvature against differences.
    double slope_error = 0, curvature_error = 0;
    for (const Vec3 x : {Vec3(10, 2, 1), Vec3(40, -1, 2.5), Vec3(70, 0.4, -0.2)})
        for (int k = 0; k < 3; ++k) {
            const double h = 1e-5;
            const Vec3 step = h * Vec3::Unit(k);
            const WallContact at = ask(wall, x), above = ask(wall, x + step), below = ask(wall, x - step);
            slope_error = std::max(
                slope_error, std::abs((above.penetration - below.penetration) / (2 * h) - at.normal[k]));
            curvature_error = std::max(
                curvature_error, ((above.normal - below.normal) / (2 * h) - at.curvature.col(k)).norm());
        }
    std::printf("gradient %s, curvature %s\n", slope_error < 1e-8 ? "agrees" : "is wrong",
                curvature_error < 1e-8 ? "agrees" : "is wrong");

    // Pushed off its axis into the narrowing cone.
    Chain chain = chain_along({wire}, Grid{}, {Vec3(0, 1, 0), Vec3(1, 1, 0.2)});
    Hub hub(RelaxerConfig{}, wall);
    hub.settle(chain, Hub::most_settling);
    for (int push = 1; push <= 24; ++push) {
        const HubReport report = hub.move(chain, {2.0, 0.0}, 1'000'000);
        if (push % 6 != 0) continue;
        const Vec3 tip = chain.joints.back();
        std::printf("%2.0f mm inside: tip (%.2f, %.2f, %.2f) mm, push %.4f N, %d joints touch\n",
                    chain.inserted_length(), tip.x(), tip.y(), tip.z(), report.relax.push_force,
                    report.relax.contacts);
    }
}
