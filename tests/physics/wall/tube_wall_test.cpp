#include "physics/wall/tube_wall.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "engine/anatomy/scenes.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

TEST(TubeWall, MeasuresPenetrationFromTheWiresSurface) {
    const TubeWall wall({{0, 0, 0}, {100, 0, 0}}, 2.0, 40.0, 0.5);
    const WallContact out = ask(wall, {30, 1.8, 0});
    EXPECT_NEAR(out.penetration, 0.3, 1e-12);
    EXPECT_NEAR(out.force(), 12.0, 1e-12);
    EXPECT_LT((out.normal - Vec3::UnitY()).norm(), 1e-12);
    const WallContact in = ask(wall, {30, 0, -1});
    EXPECT_NEAR(in.penetration, -0.5, 1e-12);
    EXPECT_EQ(in.force(), 0.0);
}

TEST(TubeWall, PushIsTheGradientOfItsEnergy) {
    const TubeWall wall(anatomy::draw(anatomy::find_scene("spatial")->path), 2.0, 40.0, 0.2);
    const Vec3 along = wall.centreline()[1001] - wall.centreline()[1000];
    const Vec3 x = wall.centreline()[1000] + 2.1 * along.cross(Vec3(0.2, -0.3, 1)).normalized();
    const WallContact c = ask(wall, x);
    ASSERT_GT(c.penetration, 0.05);
    auto energy = [&](const Eigen::VectorXd& p) { return ask(wall, Vec3(p)).energy(); };
    // The distance to a polyline has kinks of 1e-3 rad at its points; a step across one sees that much.
    EXPECT_LT((finite_gradient(energy, x, 1e-3) - c.push()).norm(), 2e-3 * c.push().norm());
}

TEST(TubeWall, NothingTouchesWithinTheTrustOfAContact) {
    const TubeWall wall(anatomy::draw(anatomy::find_scene("sinuous")->path), 1.0, 40.0);
    for (int i = 100; i < 4000; i += 97) {
        const Vec3 x = wall.centreline()[i] + Vec3(0.1, -0.2, 0.3);
        const WallContact c = ask(wall, x);
        for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(-0.6, 0, 0.8)})
            EXPECT_LE(ask(wall, x + 0.999 * c.trust * way).penetration, 0.0);
    }
}

TEST(TubeWall, AHintGivesTheAnswerOfAFullSearch) {
    const TubeWall wall(anatomy::draw(anatomy::find_scene("sinuous")->path), 1.0, 40.0);
    for (int i = 50; i < 4400; i += 131) {
        const Vec3 x = wall.centreline()[i] + Vec3(0.2, 0.5, -0.6);
        const WallContact full = ask(wall, x);
        for (int hint : {std::max(0, i - 60), i, i + 40})
            EXPECT_NEAR(ask(wall, x, hint).penetration, full.penetration, 1e-9) << i << " from " << hint;
    }
}

TEST(TubeWall, AFullSearchFindsTheClosestPartOfTheTube) {
    const TubeWall wall(anatomy::draw(anatomy::find_scene("hairpin")->path), 1.5, 40.0);
    std::mt19937 random(3);
    for (int k = 0; k < 100; ++k) {
        auto unit = [&] { return random() / 4294967296.0; };
        const Vec3 x(80 * unit() - 20, 60 * unit() - 20, 20 * unit() - 10);
        double closest = std::numeric_limits<double>::max();
        for (const Vec3& p : wall.centreline()) closest = std::min(closest, (p - x).norm());
        // The corners are 0.05 mm apart.
        const double distance = ask(wall, x).penetration + ask(wall, x).clearance;
        EXPECT_LE(distance, closest + 1e-9);
        EXPECT_GE(distance, closest - 0.025);
    }
}

TEST(TubeWall, AJointOnTheAxisOfTheTubeIsNotPushedAnywhere) {
    const TubeWall wall({{0, 0, 0}, {10, 0, 0}}, 1.0, 40.0);
    const WallContact c = ask(wall, {5, 0, 0});
    EXPECT_FALSE(c.touches());
    EXPECT_TRUE(c.normal.allFinite());
}

TEST(TubeWall, EndsInACap) {
    const TubeWall wall({{0, 0, 0}, {10, 0, 0}}, 1.0, 40.0);
    const WallContact c = ask(wall, {11.5, 0, 0});
    EXPECT_NEAR(c.penetration, 0.5, 1e-12);
    EXPECT_LT((c.normal - Vec3::UnitX()).norm(), 1e-12);
}

TEST(TubeWall, GoesOnPastEndsThatAreStatedWithoutAStep) {
    OpenEnd finish{"finish", {40, 0, 0}, Vec3::UnitX(), 2}, start{"start", {0, 0, 0}, -Vec3::UnitX(), 2};
    start.goes_on = Continuation::Sheath, start.bore = 0.6, start.length = 30;
    const OpenEnd ends[] = {start, finish};
    for (const Polyline& line :
         {Polyline{{0, 0, 0}, {40, 0, 0}}, Polyline{{0, 0, 0}, {3, 0, 0}, {40, 0, 0}}}) {
        const TubeWall wall(line, 2.0, 40.0, 0.2, ends);
        // The artery narrows, over 14 radii, and the sheath has its bore.
        EXPECT_FALSE(ask(wall, {60, 0, 0}).touches());
        EXPECT_TRUE(ask(wall, {60, 1.5, 0}).touches());
        EXPECT_TRUE(ask(wall, {72, 0, 0}).touches());
        EXPECT_FALSE(ask(wall, {-20, 0.3, 0}).touches());
        EXPECT_TRUE(ask(wall, {-20, 0.5, 0}).touches());
        constexpr double h = 1e-5;
        for (const double aside : {0.7, 1.9, 2.2})
            for (double x = -6; x < 50; x += 0.0497) {
                const Vec3 at(x, 0.8 * aside, 0.6 * aside);
                const WallContact c = ask(wall, at);
                if (!c.touches()) continue;
                for (int d = 0; d < 3; ++d) {
                    const Vec3 step = h * Vec3::Unit(d);
                    const WallContact lower = ask(wall, at - step), upper = ask(wall, at + step);
                    EXPECT_NEAR((upper.penetration - lower.penetration) / (2 * h), c.normal[d], 1e-5)
                        << at.transpose();
                    EXPECT_LT(((upper.normal - lower.normal) / (2 * h) - c.curvature.col(d)).norm(),
                              2e-2 * std::max(1.0, c.curvature.norm()))
                        << at.transpose();
                }
            }
    }
}

TEST(TubeWall, RefusesATubeThatIsNone) {
    EXPECT_THROW(TubeWall({{0, 0, 0}}, 1, 40), std::invalid_argument);
    EXPECT_THROW(TubeWall({{0, 0, 0}, {0, 0, 0}}, 1, 40), std::invalid_argument);
    EXPECT_THROW(TubeWall({{0, 0, 0}, {std::nan(""), 0, 0}}, 1, 40), std::invalid_argument);
    EXPECT_THROW(TubeWall({{0, 0, 0}, {1, 0, 0}}, 0.4, 40, 0.4), std::invalid_argument);
    EXPECT_THROW(TubeWall({{0, 0, 0}, {1, 0, 0}}, 1, 0), std::invalid_argument);
}
