#include "physics/wire/energy.h"

#include <gtest/gtest.h>

#include "physics/relax/contact_set.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

TEST(Energy, GradientAgreesWithDifferencesWithBendingTipWallAndLoad) {
    Chain wire = bent_wire(24, 1.2);
    // A tube about the first part of the wire, so narrow that most joints are pressed into it.
    const TubeWall wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 2.0, 30.0, 0.4);
    for (const Vec3& load : {Vec3(0, 0, 0), Vec3(0.3, -0.5, 0.2)}) {
        wire.load = load;
        const auto contacts = all_contacts(wire, wall);
        const Energy energy = total_energy(wire, contacts);
        ASSERT_GT(energy.wall, 1.0);
        ASSERT_EQ(std::abs(energy.load) > 1.0, load != Vec3::Zero());
        const auto gradient = energy_gradient(wire, contacts);
        for (int i = 1; i <= 24; ++i) {
            Vec3 a, b;
            tangent_basis(wire.tangents[i], a, b);
            auto total = [&](const Eigen::VectorXd& t) {
                Chain turned = wire;
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
}

TEST(Energy, OfALoadIsItsWorkOnTheWayFromTheIntroducer) {
    Chain wire = straight_wire(studies::PlainWire{}, {1, 2, 3}, {0, 0, 1}, 30);
    wire.load = Vec3(0, 0, -0.01);
    const TubeWall wall({{1, 2, 0}, {1, 2, 100}}, 2.0, 30.0);
    // q L²/2: half a segment's load at the last joint makes the sum the trapezoidal rule.
    EXPECT_NEAR(total_energy(wire, all_contacts(wire, wall)).load, 0.01 * 60 * 30, 1e-12);
    // By the paper's rule λ = 2 at each of 30 joints, of which the middle one of a pair is 31 mm up.
    wire.grid.end_cells = EndCells::Paper;
    EXPECT_NEAR(total_energy(wire, all_contacts(wire, wall)).load, 0.01 * 60 * 31, 1e-12);
}

TEST(Energy, LargestForceIsStiffnessTimesPenetration) {
    const Chain wire = bent_wire(24, 1.2);
    const TubeWall wall({{1, -2, 0}, {2, -1, 20}, {6, 3, 60}}, 2.0, 30.0, 0.4);
    const auto contacts = all_contacts(wire, wall);
    EXPECT_DOUBLE_EQ(largest_force(contacts), 30.0 * largest_penetration(contacts));
}

TEST(Energy, StraightFreeWireIsAtRest) {
    studies::PlainWire spec{.curved_length = 0, .curved_angle = 0};
    const Chain wire = straight_wire(spec, {0, 0, 0}, {1, 0, 0}, 40);
    const TubeWall wall({{-5, 0, 0}, {100, 0, 0}}, 2.0, 30.0);
    EXPECT_EQ(relative_gradient(wire, all_contacts(wire, wall)), 0.0);
}

namespace {

/// A flat wall, whose second-order energy (Eq. 9) has no remainder.
class PlaneWall final : public LumenWall {
public:
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        for (std::size_t i = 0; i < joints.size(); ++i) {
            contacts[i].normal = Vec3(0.6, 0, 0.8);
            contacts[i].penetration = contacts[i].normal.dot(joints[i]) - 4.0;
            contacts[i].stiffness = 30;
            contacts[i].trust = std::max(0.0, -contacts[i].penetration);
        }
    }
};

}  // namespace

TEST(Energy, PushAndStiffnessSumsAreTheWallsSlopeAndCurvature) {
    // U(ε_i, ε_j) = U + s_i·ε_i + s_j·ε_j + ½ ε_i R_i ε_i + ½ ε_j R_j ε_j + ε_i R_j ε_j, Eqs. 9–13 and 29.
    const Chain wire = bent_wire(24, 0.0);
    const PlaneWall wall;
    ContactSet set(wall);
    set.reset(wire);
    ASSERT_GT(set.touching(), 10);
    const int i = 14, j = 20;
    ASSERT_GT(set.contacts()[i].penetration, 0.5);  // none leaves the wall in a small step
    auto moved = [&](const Eigen::VectorXd& e) {
        Chain other = wire;
        for (int l = i; l <= 24; ++l) other.joints[l] += wire.lengths[i] * Vec3(e.head<3>());
        for (int l = j; l <= 24; ++l) other.joints[l] += wire.lengths[j] * Vec3(e.tail<3>());
        return other;
    };
    auto energy = [&](const Eigen::VectorXd& e) {
        double sum = 0;
        for (const WallContact& c : all_contacts(moved(e), wall)) sum += c.energy();
        return sum;
    };
    auto gradient = [&](const Eigen::VectorXd& e) -> Eigen::VectorXd {
        return finite_gradient(energy, e, 1e-3);
    };
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6);
    const PushSum at_i = set.sum_from(i), at_j = set.sum_from(j);
    const double li = wire.lengths[i], lj = wire.lengths[j];
    const Eigen::VectorXd slope = gradient(zero);
    EXPECT_LT((slope.head<3>() - li * at_i.force).norm(), 1e-7 * slope.norm());
    EXPECT_LT((slope.tail<3>() - lj * at_j.force).norm(), 1e-7 * slope.norm());
    const Eigen::MatrixXd curvature = finite_hessian(gradient, zero, 1e-2);
    EXPECT_LT((curvature.topLeftCorner<3, 3>() - li * li * at_i.stiffness).norm(), 1e-7 * curvature.norm());
    EXPECT_LT((curvature.bottomRightCorner<3, 3>() - lj * lj * at_j.stiffness).norm(),
              1e-7 * curvature.norm());
    EXPECT_LT((curvature.topRightCorner<3, 3>() - li * lj * at_j.stiffness).norm(), 1e-7 * curvature.norm());
}
