#include "engine/studies/bent_tube.h"

#include <cmath>
#include <gtest/gtest.h>

#include "physics/wall/tube_wall.h"
#include "tests/finite_difference.h"

namespace studies {
namespace {

using geometry::Vec3;

physics::WallContact ask(const physics::LumenWall& wall, const Vec3& x) {
    physics::WallContact c;
    wall.contacts({&x, 1}, {&c, 1});
    return c;
}

/// Places in the bend, near its axis, at its walls and past both ends.
const Vec3 places[] = {{10, 4, 0.5},  {28, 20, -1.9}, {25, 12, 0.3},  {-1.5, 0.4, 0.2},
                       {16, 57, 2.5}, {10, 59, 0.1},  {-3, 60.5, 1.2}};

TEST(BentTube, IsTheTubeThatAFinePolylineMakes) {
    geometry::Polyline axis;
    for (int i = 0; i <= 27000; ++i)
        axis.emplace_back(30 * std::sin(1e-4 * i), 30 - 30 * std::cos(1e-4 * i), 0);
    const BentTube tube(30, 2.7, 3, 42);
    const physics::TubeWall wall(axis, 3, 42);
    for (const Vec3& x : places) {
        const auto expected = ask(wall, x), found = ask(tube, x);
        EXPECT_NEAR(found.penetration, expected.penetration, 1e-7) << x.transpose();
        EXPECT_LT((found.normal - expected.normal).norm(), 1e-3) << x.transpose();
        EXPECT_EQ(found.stiffness, 42);
        EXPECT_EQ(found.clearance, 3);
    }
}

TEST(BentTube, NormalAndCurvatureAreTheSlopesOfThePenetration) {
    const BentTube tube(30, 2.7, 3, 42);
    for (const Vec3& x : places) {
        const auto c = ask(tube, x);
        const Eigen::VectorXd slope = finite_gradient(
            [&](const Eigen::VectorXd& p) { return ask(tube, Vec3(p)).penetration; }, x, 1e-3);
        EXPECT_LT((slope - c.normal).norm(), 1e-8) << x.transpose();
        const Eigen::MatrixXd bend = finite_hessian(
            [&](const Eigen::VectorXd& p) { return Eigen::VectorXd(ask(tube, Vec3(p)).normal); }, x, 1e-5);
        EXPECT_LT((bend - c.curvature).norm(), 1e-7) << x.transpose();
    }
}

}  // namespace
}  // namespace studies
