#include "physics/wall/narrowed_wall.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "physics/wall/foundation.h"
#include "physics/wall/tube_wall.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

constexpr double axis_radius = 20;  // radius of the tube's axis [mm]

Vec3 on_axis(double s) {
    return axis_radius * Vec3(std::sin(s / axis_radius), 1 - std::cos(s / axis_radius), 0);
}
Vec3 outward(double s) {
    return Vec3(std::sin(s / axis_radius), -std::cos(s / axis_radius), 0);
}

std::shared_ptr<const LumenWall> bent_tube() {
    Polyline axis;
    for (double s = 0; s <= 60; s += 0.01) axis.push_back(on_axis(s));
    return std::make_shared<TubeWall>(axis, 2.0, 10.0, 0.25);
}

/// From 20 to 40 mm closed to 0.8 mm, or as a flap of that width on one side.
Narrowing narrowing(bool flap = false) {
    Narrowing made;
    for (double s = 14; s <= 46; s += Narrowing::spacing) {
        const double fraction = std::exp(-std::pow((s - 30) / 6, 4));
        Narrowing::Sample sample;
        sample.at = on_axis(s);
        sample.radius = 2.1 - 1.3 * fraction;
        sample.lumen = 2.0;
        if (flap) sample.aside = 1.2 * fraction * Vec3::UnitZ(), sample.lumen += 1.2 * fraction;
        made.samples.push_back(sample);
    }
    return made;
}

NarrowedWall narrowed(bool flap = false) {
    NarrowedWall wall(bent_tube(), 0.25);
    wall.narrow({narrowing(flap)});
    return wall;
}

}  // namespace

TEST(NarrowedWall, IsTheVesselsWhereNothingNarrowsThem) {
    const std::shared_ptr<const LumenWall> vessel = bent_tube();
    NarrowedWall wall(vessel, 0.25);
    const auto same = [&](const Vec3& x) {
        const WallContact a = ask(*vessel, x), b = ask(wall, x);
        EXPECT_EQ(a.penetration, b.penetration);
        EXPECT_EQ(a.normal, b.normal);
        EXPECT_EQ(a.curvature, b.curvature);
        EXPECT_EQ(a.stiffness, b.stiffness);
    };
    same(on_axis(30) + 1.9 * outward(30));
    wall.narrow({narrowing()});
    same(on_axis(5) + 1.9 * outward(5));
    EXPECT_NE(ask(wall, on_axis(30) + 1.9 * outward(30)).penetration,
              ask(*vessel, on_axis(30) + 1.9 * outward(30)).penetration);
    wall.narrow({});
    same(on_axis(30) + 1.9 * outward(30));
}

TEST(NarrowedWall, StandsAsFarInAsTheTubeIsNarrow) {
    const NarrowedWall wall = narrowed(), flap = narrowed(true);
    for (const Vec3& way : {outward(30), Vec3(-outward(30)), Vec3(Vec3::UnitZ())}) {
        // A lumen of 0.8 mm about 0.02 mm wider than its samples say, which are means along it.
        EXPECT_NEAR(ask(wall, on_axis(30) + 1.5 * way).penetration, 1.5 + 0.25 - 0.8, 0.04);
        EXPECT_LT(ask(wall, on_axis(30) + 0.4 * way).penetration, 0);
    }
    EXPECT_NEAR(wall.narrowest(on_axis(30)), 0.8, 0.04);
    EXPECT_EQ(wall.narrowest(on_axis(3)), std::numeric_limits<double>::infinity());
    // The flap leaves the lumen on one side: there the vessel's wall is as near as before.
    EXPECT_NEAR(ask(flap, on_axis(30) + 1.5 * Vec3::UnitZ()).penetration, 1.75 - 2.0, 0.05);
    EXPECT_NEAR(ask(flap, on_axis(30) - 0.5 * Vec3::UnitZ()).penetration, 1.7 + 0.25 - 0.8, 0.05);
    EXPECT_NEAR(ask(flap, on_axis(30) - 1.9 * Vec3::UnitZ()).penetration, 3.1 + 0.25 - 0.8, 0.05);
}

TEST(NarrowedWall, PushIsTheGradientOfItsEnergy) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const bool flap : {false, true}) {
        const NarrowedWall wall = narrowed(flap);
        int touching = 0, blended = 0;
        for (int k = 0; k < 400; ++k) {
            const double s = 30 + 14 * unit(random);
            const Vec3 x =
                on_axis(s) + 2.2 * std::abs(unit(random)) * Vec3(unit(random), unit(random), unit(random));
            const WallContact c = ask(wall, x);
            if (c.penetration < 0.02) continue;
            ++touching;
            blended += std::abs(c.penetration - ask(*wall.vessels(), x).penetration) < 0.05;
            const auto energy = [&](const Eigen::VectorXd& p) { return ask(wall, Vec3(p)).energy(); };
            EXPECT_LT((finite_gradient(energy, x, 1e-4) - c.push()).norm(), 2e-3 * c.push().norm()) << s;
        }
        EXPECT_GT(touching, 50);
        EXPECT_GT(blended, 3);
    }
}

TEST(NarrowedWall, ATubesDepthIsTwiceDifferentiableToItsEnd) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const bool flap : {false, true}) {
        const Narrowing tube = narrowing(flap);
        int ending = 0, there = 0;
        for (int k = 0; k < 400; ++k) {
            const Vec3 x =
                on_axis(30 + 16 * unit(random)) + 2.4 * Vec3(unit(random), unit(random), unit(random));
            Narrowing::Depth at;
            if (!tube.depth(x, 0.25, at)) continue;
            ++there;
            ending += at.value < -1;
            const auto value = [&](const Eigen::VectorXd& p) {
                Narrowing::Depth depth;
                return tube.depth(Vec3(p), 0.25, depth) ? depth.value : -100.0;
            };
            const auto gradient = [&](const Eigen::VectorXd& p) -> Eigen::VectorXd {
                Narrowing::Depth depth;
                tube.depth(Vec3(p), 0.25, depth);
                return depth.gradient;
            };
            EXPECT_LT((finite_gradient(value, x, 1e-4) - at.gradient).norm(),
                      1e-6 * (1 + at.gradient.norm()));
            EXPECT_LT((finite_hessian(gradient, x, 1e-4) - at.hessian).norm(),
                      1e-4 * (1 + at.hessian.norm()));
        }
        EXPECT_GT(there, 200);
        EXPECT_GT(ending, 10);
    }
}

TEST(NarrowedWall, NothingTouchesWithinTheTrustOfAContact) {
    const NarrowedWall wall = narrowed();
    std::mt19937 random(9);
    std::uniform_real_distribution<double> unit(-1, 1);
    int trusted = 0;
    for (int k = 0; k < 4000; ++k) {
        const Vec3 x = on_axis(30 + 30 * unit(random)) + 1.5 * Vec3(unit(random), unit(random), unit(random));
        const WallContact c = ask(wall, x);
        if (c.touches()) continue;
        const Vec3 way = Vec3(unit(random), unit(random), unit(random)).normalized();
        trusted += c.trust > 0;
        EXPECT_LE(ask(wall, x + 0.999 * c.trust * way).penetration, 0.0);
    }
    EXPECT_GT(trusted, 500);
}

TEST(NarrowedWall, HoldsADeviceByWhatFillsItOnlyWithinIt) {
    Narrowing clot = narrowing();
    for (Narrowing::Sample& sample : clot.samples) sample.radius = 2.1, sample.shear = 1e-3;
    NarrowedWall wall(bent_tube(), 0.25);
    wall.narrow({clot});
    EXPECT_NEAR(wall.holds(on_axis(30), 0.5, 0), 2 * M_PI * 0.5 * 1e-3, 1e-6);
    EXPECT_EQ(wall.holds(on_axis(30) + 5 * outward(30), 0.5, 0), 0);
    EXPECT_EQ(wall.holds(on_axis(3), 0.5, 0), 0);
    EXPECT_LT(ask(wall, on_axis(30) + 1.5 * outward(30)).penetration, 0);
}

/// A joint that has pushed its vessel aside by more than a narrow tube in it is wide is still in that tube:
/// its first question, from where the tube is not, finds the place that every later one finds again.
TEST(NarrowedWall, AVesselMakesWayForAJointBeyondItsTubeAsItDoesWhenAskedAgain) {
    constexpr double radius = 2.0, joint = 0.25;
    Polyline axis;
    for (double s = 0; s <= 60; s += 0.25) axis.push_back(on_axis(s));
    const CentrelineBranch branch{"tube", -1, -1, axis, std::vector<double>(axis.size(), radius)};
    const Tissue tissue;
    const auto vessel = std::make_shared<TubeWall>(axis, radius, 20.0, joint);
    vessel->lie_in(std::make_shared<Foundation>(std::span(&branch, 1), std::span(&tissue, 1)));
    NarrowedWall wall(vessel, joint);
    wall.narrow({narrowing()});
    int touching = 0;
    for (unsigned seed = 1; seed <= 4000; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        SCOPED_TRACE("seed " + std::to_string(seed));
        const double s = 16 + 28 * unit(random), angle = 2 * M_PI * unit(random);
        const Vec3 way = std::cos(angle) * outward(s) + std::sin(angle) * Vec3::UnitZ();
        const Vec3 x = on_axis(s) + (1 + 3 * unit(random)) * way;
        WallContact first;
        first.station = static_cast<int>(std::lround(s / 0.25));
        first.give = std::pow(10, 3 * unit(random) - 0.3);
        first.along = Vec3::UnitZ().cross(outward(s));
        const WallContact asked = first;
        wall.contacts({&x, 1}, {&first, 1});
        if (!first.touches()) continue;
        ++touching;
        // The vessel goes with the joint, which is nowhere deeper in the wall than the force there explains.
        const Vec3 y = x - first.given;
        EXPECT_LT((y - on_axis(s)).norm(), radius + 0.1) << s;
        // Where the tube narrows its normal is longer than a unit there, by a tenth at most.
        const double pressed = first.force() * first.normal.norm();
        EXPECT_NEAR(20 * std::max(0.0, ask(wall, y).penetration), pressed, 0.05 + 0.1 * pressed) << s;
        WallContact again = asked;
        again.given = first.given;
        wall.contacts({&x, 1}, {&again, 1});
        EXPECT_NEAR(again.energy(), first.energy(), 1e-6 * first.energy() + 1e-12) << s;
        EXPECT_LT((again.given - first.given).norm(), 1e-3) << s;
    }
    EXPECT_GT(touching, 3000);
}
