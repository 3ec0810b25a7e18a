#include "physics/energy.h"

#include <gtest/gtest.h>

#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

TEST(Energy, GradientAgreesWithDifferencesWithBendingTipAndWall) {
    const Guidewire wire = bent_wire(24, 1.2);
    // A tube about the first part of the wire, so narrow that most joints are pressed into it.
    const TubeWall wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 2.0, 30.0, 0.4);
    const auto contacts = all_contacts(wire, wall);
    const Energy energy = total_energy(wire, contacts);
    ASSERT_GT(energy.wall, 1.0);
    const auto gradient = energy_gradient(wire, contacts);
    for (int i = 1; i <= 24; ++i) {
        Vec3 a, b;
        tangent_basis(wire.tangents[i], a, b);
        auto total = [&](const Eigen::VectorXd& t) {
            Guidewire turned = wire;
            turned.tangents[i] = (wire.tangents[i] + t[0] * a + t[1] * b).normalized();
            rebuild_joints(turned);
            return total_energy(turned, all_contacts(turned, wall)).total();
        };
        const Eigen::VectorXd slope = finite_gradient(total, Eigen::VectorXd::Zero(2), 1e-5);
        const double scale = std::max(gradient[i].norm(), wire.spring_constant(i - 1));
        EXPECT_NEAR(slope[0], gradient[i].dot(a), 1e-7 * scale) << i;
        EXPECT_NEAR(slope[1], gradient[i].dot(b), 1e-7 * scale) << i;
    }
}

TEST(Energy, LargestForceIsStiffnessTimesPenetration) {
    const Guidewire wire = bent_wire(24, 1.2);
    const TubeWall wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 2.0, 30.0, 0.4);
    const auto contacts = all_contacts(wire, wall);
    EXPECT_DOUBLE_EQ(largest_force(contacts), 30.0 * largest_penetration(contacts));
}

TEST(Energy, StraightFreeWireIsAtRest) {
    GuidewireSpec spec;
    spec.curved_length = spec.curved_angle = 0;
    const Guidewire wire = straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 40);
    const TubeWall wall({{-5, 0, 0}, {100, 0, 0}}, 2.0, 30.0);
    EXPECT_EQ(relative_gradient(wire, all_contacts(wire, wall)), 0.0);
}
