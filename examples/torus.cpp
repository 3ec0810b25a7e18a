/// A guidewire is pushed round a lumen that is a torus. The wall is this program's own, in closed form; every
/// push ends in an equilibrium that the solver has certified.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "physics/relax/hub.h"

using namespace physics;

/// A lumen of radius `lumen` around a ring of radius `ring` about z.
class Torus final : public LumenWall {
public:
    Torus(double ring, double lumen, double stiffness, double wire_radius)
        : ring_(ring), lumen_(lumen), stiffness_(stiffness), wire_radius_(wire_radius) {}

    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        require_finite(joints);
        for (std::size_t i = 0; i < joints.size(); ++i) {
            const Vec3& x = joints[i];
            WallContact& c = contacts[i];
            const double from_axis = std::hypot(x.x(), x.y());
            const Vec3 outward(x.x() / from_axis, x.y() / from_axis, 0), along(-outward.y(), outward.x(), 0);
            const Vec3 offset = x - ring_ * outward;
            const double distance = std::max(offset.norm(), 1e-9);
            const double clearance = lumen_ - wire_radius_ - c.thickness;
            c.penetration = distance - clearance;
            c.normal = offset / distance;
            // Across the tube the wall curves as a circle about its centreline, along it as one about z.
            c.curvature =
                (Mat3::Identity() - c.normal * c.normal.transpose() - along * along.transpose()) / distance +
                c.normal.dot(outward) / from_axis * along * along.transpose();
            c.stiffness = stiffness_ * c.fraction;
            c.stiffening = Vec3::Zero();
            c.trust = std::max(0.0, -c.penetration);
            c.clearance = clearance;
            c.station = 0;
        }
    }

private:
    double ring_, lumen_, stiffness_, wire_radius_;  // [mm], [mm], [N/mm], [mm]
};

int main() {
    // A wire of 0.035 inch: EI 6 N·mm² at its tip, 250 at its shaft; the last 10 mm are bent by 45°.
    Device wire;
    wire.spec.sections = soft_tip(6, 30, 40, 250);
    wire.spec.shape = {{10, std::numbers::pi / 4, 0}};
    wire.inserted = 40;

    Polyline ring;
    for (int degrees = 0; degrees < 360; ++degrees) {
        const double angle = degrees * std::numbers::pi / 180;
        ring.emplace_back(40 * std::cos(angle), 40 * std::sin(angle), 0);
    }
    const Torus wall(40, 3, 5, wire.spec.outer_diameter / 2);
    Chain chain = chain_along({wire}, Grid{}, ring);
    Hub hub(RelaxerConfig{}, wall);
    hub.settle(chain, Hub::most_settling);
    for (int push = 1; push <= 90; ++push) {
        const HubReport report = hub.move(chain, {2.0, 0.0}, 1'000'000);
        if (push % 15 != 0) continue;
        double sum = 0, most = 0;
        for (const WallContact& contact : hub.contacts()) {
            sum += contact.force();
            most = std::max(most, contact.force());
        }
        std::printf("%3.0f mm inside: push %.4f N, on the wall %.3f N, %.3f N at most, %s\n",
                    chain.inserted_length(), report.relax.push_force, sum, most,
                    report.relax.strict_minimum() ? "a strict minimum" : "not certified");
    }
}
