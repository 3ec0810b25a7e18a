#include "engine/studies/plane_wire.h"

#include <cmath>
#include <gtest/gtest.h>

#include "tests/physics/elastica.h"

namespace studies {
namespace {

using geometry::Vec2;

TEST(PlaneWire, SagsAsABeamUnderALittleLoadAndItsEnergyIsHalfTheLoadsWork) {
    const double beam = 1e-6 * std::pow(40.0, 4) / (8 * 50);
    const PlaneCurve curve =
        exact_curve({.rigidity = 50, .length = 40, .load = Vec2(0, -1e-6)}, 10, 0, Vec2::Zero());
    ASSERT_EQ(curve.points.size(), 11u);
    EXPECT_NEAR(-curve.points.back().place[1] / beam, 1, 1e-7);
    // −½ ∫ q y = −q² L⁵/40EI
    EXPECT_NEAR(curve.energy / (-1e-12 * std::pow(40.0, 5) / (40 * 50)), 1, 1e-7);
    EXPECT_LT(curve.residual, 1e-12);
}

TEST(PlaneWire, KeepsTheFirstIntegralOfTheElastica) {
    // ½ M²/EI + n·t is the same all along a wire without load.
    PlaneWire wire{.rigidity = 50, .length = 20, .angle = 0.6, .tip_stiffness = 1e4};
    wire.wall = [](const Vec2& x) { return PlaneContact{x[1] - 6, Vec2(0, 1)}; };
    const PlaneCurve curve = exact_curve(wire, 40, -2, Vec2(0, -0.1));
    EXPECT_LT(curve.residual, 1e-9);
    EXPECT_LT(curve.step_error, 1e-10);
    const auto integral = [](const PlanePoint& p) {
        return p.moment * p.moment / 100 + p.force.dot(Vec2(std::cos(p.angle), std::sin(p.angle)));
    };
    for (const PlanePoint& p : curve.points) EXPECT_NEAR(integral(p), integral(curve.points.back()), 1e-11);
    EXPECT_LT(curve.points.back().force[1], 0);
}

TEST(PlaneWire, IsTheElasticaThatAnotherIntegrationFinds) {
    // By bisection from the tip instead of Newton's method from the clamp.
    Elastica hanging{.rigidity = 50, .length = 40, .load = 4e-3};
    hanging.clamp_at(0);
    const PlaneCurve curve =
        exact_curve({.rigidity = 50, .length = 40, .load = Vec2(0, -4e-3)}, 8, -2, Vec2(0, -0.16));
    EXPECT_LT((curve.points.back().place - Vec2(hanging.x, hanging.y)).norm(), 1e-9);

    Elastica pressing{.rigidity = 50, .length = 20};
    pressing.rest_at(0.6, 6);
    PlaneWire wire{.rigidity = 50, .length = 20, .angle = 0.6, .tip_stiffness = 1e9};
    wire.wall = [](const Vec2& x) { return PlaneContact{x[1] - 6, Vec2(0, 1)}; };
    const PlaneCurve pressed = exact_curve(wire, 8, -2, Vec2(0, -0.1));
    EXPECT_NEAR(-pressed.points.back().force[1] / pressing.tip_force, 1, 1e-6);
    EXPECT_NEAR(pressed.points.back().place[0], pressing.x, 1e-7);
    EXPECT_NEAR(pressed.energy / pressing.bending_energy, 1, 1e-6);
}

}  // namespace
}  // namespace studies
