/// The closed aortic valve: what it costs to part its cusps, one energy with its derivatives, what a tip that
/// is pushed through feels, and a loop that is stopped.

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "physics/relax/hub.h"
#include "physics/wall/past_end.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"
#include "tests/finite_difference.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

constexpr double aorta = 15;  // radius [mm]
constexpr int as_long_as_it_takes = 1'000'000'000;

OpenEnd closed_valve() {
    OpenEnd end{"valve", Vec3::Zero(), Vec3::UnitZ(), aorta};
    end.goes_on = Continuation::Root;
    return end;
}
const Polyline axis_of_aorta = {{0, 0, -250}, {0, 0, 0}};

/// The ascending aorta and its root, for a wire of this radius with segments of λ [mm].
TubeWall aorta_for(double wire_radius, double lambda) {
    const OpenEnd end = closed_valve();
    return TubeWall(axis_of_aorta, aorta, WallStiffness(5 * lambda).per(lambda), wire_radius, {&end, 1});
}

/// 8/3 √2 p √R a^(3/2), by the numbers that the valve is made of.
double parting_force(double radius) {
    return 8.0 / 3 * std::sqrt(2.0) * 9.33e-3 * std::sqrt(0.55 * aorta) * std::pow(radius, 1.5);
}

struct Course {
    double push = 0, deepest = 0;  // largest push [N]; farthest joint past the plane [mm]
    bool refused = false;
};

/// Pushes on, half a millimetre at a time, as long as the hub makes it and with no more than this [N].
Course push_on(Hub& hub, Chain& wire, const TubeWall& wall, double mm, double most) {
    Course course;
    for (double way = 0; way < mm && !course.refused && course.push < most; way += 0.5) {
        course.refused = hub.move(wire, {0.5, 0}, as_long_as_it_takes).outcome != HubReport::Outcome::AtRest;
        const auto contacts = all_contacts(wire, wall);
        if (!course.refused) {
            EXPECT_LE(relative_gradient(wire, contacts), 2e-8) << way;
        }
        course.push = std::max(course.push, hub_loads(wire, contacts)[0].push);
        for (const Vec3& x : wire.joints) course.deepest = std::max(course.deepest, x.z());
    }
    return course;
}

}  // namespace

TEST(Valve, TwoMembranesThatARodLiftsApartCostWhatTheirArcsDo) {
    // Numbers of its own: the membranes' height over the middle is (L − s)²/2R up to where they touch.
    Seam seam;
    seam.pressure = 0.01, seam.curvature = 9;
    for (const double a : {0.2, 0.45, 1.0}) {
        const double reach = std::sqrt(2 * seam.curvature * a), step = reach / 20000;
        double area = 0, longer = 0;
        for (double s = 0.5 * step; s < reach; s += step) {
            area += 4 * (reach - s) * (reach - s) / (2 * seam.curvature) * step;
            longer += 4 * 0.5 * std::pow((reach - s) / seam.curvature, 2) * step;
        }
        const double cost = seam.pressure * area + seam.pressure * seam.curvature * longer;
        EXPECT_NEAR(seam.force(a), cost, 1e-6 * cost) << a;
        const double h = 1e-6;
        EXPECT_NEAR(seam.squeeze(a), (seam.force(a + h) - seam.force(a - h)) / (2 * h), 1e-6) << a;
    }
}

TEST(Valve, IsOneEnergyWithItsDerivatives) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    for (const double radius : {0.175, 0.445, 1.0}) {
        const TubeWall wall = aorta_for(radius, 2);
        const Seam seam = cones_past(closed_valve()).seam;
        int of_cusps = 0, of_walls = 0;
        for (int n = 0; n < 1500; ++n) {
            const double aside = 2.2 * std::sqrt(unit(random)), angle = 7 * unit(random);
            const Vec3 x(aside * std::cos(angle), aside * std::sin(angle),
                         seam.middle + 1.1 * seam.half * (2 * unit(random) - 1));
            const auto energy = [&](const Eigen::VectorXd& p) {
                const WallContact c = ask(wall, Vec3(p));
                return c.touches() ? c.energy() : 0.0;
            };
            const auto push = [&](const Eigen::VectorXd& p) {
                return Eigen::VectorXd(ask(wall, Vec3(p)).push());
            };
            const WallContact c = ask(wall, x);
            if (!c.touches()) continue;
            ++(std::abs(c.stiffness - 10) > 1e-9 ? of_cusps : of_walls);
            EXPECT_LT((finite_gradient(energy, x, 1e-5) - c.push()).norm(),
                      1e-6 * std::max(1.0, c.push().norm()))
                << x.transpose();
            const Mat3 hessian = c.stiffness * c.normal * c.normal.transpose() + c.force() * c.curvature;
            EXPECT_LT((finite_hessian(push, x, 1e-6) - hessian).norm(), 2e-3 * std::max(1.0, hessian.norm()))
                << x.transpose();
        }
        EXPECT_GT(of_cusps, 100);
        EXPECT_GT(of_walls, 100);
    }
}

TEST(Valve, NothingTouchesWithinTheTrustOfAContact) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> unit(-1, 1);
    const TubeWall wall = aorta_for(0.445, 2);
    int asked = 0;
    for (int n = 0; n < 20000; ++n) {
        const Vec3 x(6 * unit(random), 6 * unit(random), 22 + 18 * unit(random));
        const WallContact c = ask(wall, x);
        if (c.touches() || !(c.trust > 0)) continue;
        ++asked;
        const Vec3 way = Vec3(unit(random), unit(random), unit(random)).normalized();
        EXPECT_FALSE(ask(wall, x + 0.999 * c.trust * way).touches()) << x.transpose();
    }
    EXPECT_GT(asked, 1000);
}

/// A straight wire or catheter that comes down the axis passes with the force that parts the cusps, and once
/// its tip is through, is held no more.
TEST(Valve, AStraightTipIsHeldByTheForceThatPartsTheCusps) {
    for (const double lambda : {0.5, 1.0, 2.0})
        for (const double radius : {0.175, 0.445, 1.0}) {
            const TubeWall wall = aorta_for(radius, lambda);
            Hub hub({}, wall);
            // Stiff enough not to bow on the way, as a shaft between the walls of the aorta would.
            Chain wire = wire_of_length(studies::PlainWire::uniform(20000, lambda), axis_of_aorta, 248);
            hub.settle(wire, as_long_as_it_takes);
            const Course through = push_on(hub, wire, wall, 40, 5);
            EXPECT_FALSE(through.refused);
            EXPECT_GT(wire.tip().z(), floor_of_root(closed_valve()) + 6);
            // The tip's joints come to the middle one by one.
            EXPECT_NEAR(through.push, parting_force(radius), (0.03 + 0.08 * lambda) * parting_force(radius))
                << radius << ", λ " << lambda;
            const double held = hub_loads(wire, all_contacts(wire, wall))[0].push;
            EXPECT_LT(std::abs(held), 0.1 * parting_force(radius)) << radius << ", λ " << lambda;
        }
    EXPECT_NEAR(parting_force(0.445), 0.030, 0.001);  // a wire of 0.035 inch
    EXPECT_NEAR(parting_force(1.0), 0.101, 0.001);    // a catheter of 6 F
}

/// A tip beside the middle lies in a sinus: its floor holds whatever is pushed.
TEST(Valve, TheFloorOfASinusHolds) {
    const double radius = 0.445;
    const TubeWall wall = aorta_for(radius, 2);
    const RoundCones cones = cones_past(closed_valve());
    const Vec3 beside = cones.cones[1].aside;
    Polyline line = {beside + Vec3(0, 0, -250), beside};
    Hub hub({}, wall);
    Chain wire = wire_of_length(studies::PlainWire::uniform(20000, 2), line, 248);
    hub.settle(wire, as_long_as_it_takes);
    const Course course = push_on(hub, wire, wall, 32, 1);
    EXPECT_LT(course.deepest, floor_of_root(closed_valve()) + 1);
    EXPECT_GT(course.push, 1);
}

/// A wire that comes down as a loop lies across the cusps: pushed with many times the force by which its
/// straight tip would pass, it stays above their floors.
TEST(Valve, ALoopIsStopped) {
    const double radius = 0.445;
    const TubeWall wall = aorta_for(radius, 2);
    for (const double turned : {0.0, 0.5, 1.0}) {
        Hub hub({}, wall);
        const studies::PlainWire loop{.segment_length = 2,
                                      .tip_length = 20,
                                      .transition_length = 40,
                                      .curved_length = 34,
                                      .curved_angle = std::numbers::pi};
        Chain wire = wire_of_length(loop, axis_of_aorta, 230);
        rotate(wire, every_device, turned);
        hub.settle(wire, as_long_as_it_takes);
        const Course course = push_on(hub, wire, wall, 90, 5);
        EXPECT_LT(course.deepest, floor_of_root(closed_valve()) + 1) << turned;
        EXPECT_GT(course.push, 2 * parting_force(radius)) << turned;
        EXPECT_GT(course.deepest, 15) << turned;  // it has come as far as the cusps
    }
}

/// Hands that push, pull and turn a wire in the root: at every rest no joint is farther outside the lumen
/// than its force explains.
TEST(Valve, WildHandsInTheRootLeaveNoJointOutside) {
    const double radius = 0.445;
    const TubeWall wall = aorta_for(radius, 2);
    const RoundCones cones = cones_past(closed_valve());
    int outside = 0, rests = 0;
    for (const unsigned seed : {1u, 2u, 3u}) {
        std::mt19937 random(seed);
        const auto unit = [&] { return random() / 4294967296.0; };
        Hub hub({}, wall);
        Chain wire = wire_of_length(tipped(2, 1.2), axis_of_aorta, 230);
        hub.settle(wire, as_long_as_it_takes);
        for (int frame = 0; frame < 150; ++frame) {
            const double feed = 8 * (unit() - 0.35);
            hub.move(wire, {feed, 2 * (unit() - 0.5)}, as_long_as_it_takes);
            const auto contacts = all_contacts(wire, wall);
            ASSERT_LE(relative_gradient(wire, contacts), 2e-8) << seed << ", frame " << frame;
            ++rests;
            for (int i = 1; i <= wire.segments(); ++i) {
                const Vec3& x = wire.joints[i];
                if (x.z() < 0.31 * aorta) continue;
                // Each of the cones without the rounding between them.
                double least = std::numeric_limits<double>::infinity();
                for (const RoundCone& cone : cones.all()) {
                    const double along = std::max({0.0, x.z() - cone.last - 0.5, cone.first - x.z() - 0.5});
                    const double wide = cone.radius - cone.narrows * std::max(0.0, x.z() - cone.starts);
                    const Vec3 beside = x - x.z() * Vec3::UnitZ() - cone.aside;
                    least = std::min(least, std::hypot(beside.norm(), along) - wide);
                }
                const double pressed = std::max(0.0, contacts[i].penetration);
                outside += least + radius - pressed > 0.2;
            }
        }
    }
    EXPECT_EQ(outside, 0);
    EXPECT_EQ(rests, 450);
}
