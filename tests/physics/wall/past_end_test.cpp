/// The vessels past open ends: their shape, one energy with its derivatives, promises that are kept, the
/// force that a wedged wire holds, and nothing that leaves.

#include "physics/wall/past_end.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

using namespace physics;

namespace {

OpenEnd end_of(Continuation what, double radius, double length = std::numeric_limits<double>::infinity()) {
    OpenEnd end{"end", Vec3(3, -2, 5), Vec3(0.6, 0, 0.8), radius};
    end.goes_on = what;
    end.bore = 0.85;
    end.length = what == Continuation::Sheath ? 110 : length;
    return end;
}
std::vector<OpenEnd> all_ends() {
    return {end_of(Continuation::Artery, 2),    end_of(Continuation::Artery, 0.4),
            end_of(Continuation::Artery, 6, 9), end_of(Continuation::Root, 15),
            end_of(Continuation::Root, 11),     end_of(Continuation::Sheath, 4)};
}

/// `out` past the plane, `aside` of the axis.
Vec3 place(const OpenEnd& end, double out, double aside, double angle = 0.4) {
    Vec3 a, b;
    tangent_basis(end.outward_normal, a, b);
    return end.centre + out * end.outward_normal + aside * (std::cos(angle) * a + std::sin(angle) * b);
}

constexpr int first[] = {0};
WallContact ask_past(const OpenEnd& end, const Vec3& x, double joint = 0) {
    WallContact c;
    c.trust = 1e9;
    const ContinuedEnd continued{end, cones_past(end)};
    const PastEnd past(x, {&continued, 1}, first, 0);
    if (past.inside())
        past.limit(x, joint, c);
    else
        past.apply(x, joint, 1, c);
    return c;
}

double reach(const OpenEnd& end) {
    return end.goes_on == Continuation::Root     ? 1.79 * end.radius + 95
           : end.goes_on == Continuation::Sheath ? end.length
                                                 : std::min(14 * end.radius, end.length);
}

/// Places all along it, near its axis and beside it.
template <class Visit>
void all_over(const OpenEnd& end, unsigned seed, int count, const Visit& visit) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int n = 0; n < count; ++n) {
        const double out = 1e-3 + (reach(end) + 3) * unit(random) * (n % 3 ? 1 : 0.1),
                     aside = 1.3 * std::max(end.radius, 1.0) * unit(random) * (n % 2 ? 1 : 0.1);
        visit(place(end, out, aside, 2 * std::numbers::pi * unit(random)), random);
    }
}

}  // namespace

TEST(PastEnd, AnArteryIsARoundConeWithAClosedTip) {
    const OpenEnd end = end_of(Continuation::Artery, 2);
    const double narrows = (2 - 0.3 - 0.1875) / 28;  // of the radius, over 14 radii
    for (const double out : {0.5, 3.0, 14.0, 28.0})
        for (const double aside : {0.5, 1.0, 2.0, 3.5})
            EXPECT_NEAR(ask_past(end, place(end, out, aside), 0.18).penetration,
                        aside - (2 - narrows * (out - 0.25)) + 0.18, 1e-9)
                << out << " " << aside;
    // On the axis 0.3 mm are left where it is closed.
    EXPECT_NEAR(ask_past(end, place(end, 28, 0)).penetration, -0.3, 0.02);
    for (const double radius : {0.18, 0.25, 0.45, 0.85}) {
        const WallContact c = ask_past(end, place(end, 30, 0), radius);
        EXPECT_GT(c.penetration, 0.9) << radius;  // the tip of no wire goes two millimetres farther
        EXPECT_GT(c.normal.dot(end.outward_normal), 0.95) << radius;
    }
    EXPECT_FALSE(ask_past(end, place(end, 27, 0), 0.18).touches());
}

TEST(PastEnd, AnEndThatIsCutShortIsClosedByABall) {
    const OpenEnd end = end_of(Continuation::Artery, 6, 9);
    EXPECT_FALSE(ask_past(end, place(end, 13, 0), 0.4).touches());
    EXPECT_TRUE(ask_past(end, place(end, 15.5, 0), 0.4).touches());
}

TEST(PastEnd, TheRootHasThreeSinusesAndAHoleIntoTheVentricle) {
    const OpenEnd end = end_of(Continuation::Root, 15);
    const auto touches = [&](double out, double aside, double angle, double joint) {
        return ask_past(end, place(end, out, aside, angle), joint).touches();
    };
    constexpr double third = 2 * std::numbers::pi / 3;
    EXPECT_NEAR(floor_of_root(end), 27.35, 1e-9);
    for (int k = 0; k < 3; ++k) {
        // A wire of 0.89 mm lies in the sinuses and not in the walls between.
        EXPECT_FALSE(touches(26.8, 9.3, k * third, 0.445)) << k;
        EXPECT_TRUE(touches(27, 9.3, k * third, 0.445)) << k;
        EXPECT_FALSE(touches(19, 16.9, k * third, 0.445)) << k;
        EXPECT_TRUE(touches(19, 17.3, k * third, 0.445)) << k;
        EXPECT_TRUE(touches(18, 15, (k + 0.5) * third, 0.445)) << k;
        EXPECT_TRUE(touches(22, 8.7, (k + 0.5) * third, 0.445)) << k;
    }
    // Wire and catheter of 6 F go through the hole, one of 7 F does not, and the wire turns in the ventricle.
    for (double out = 0; out < 100; out += 0.5) EXPECT_FALSE(touches(out, 0, 0, 1.0)) << out;
    EXPECT_TRUE(touches(25, 0, 0, 1.17));
    EXPECT_TRUE(touches(25, 1.5, 0, 0.445));
    EXPECT_FALSE(touches(60, 20, 1, 0.445));
    EXPECT_TRUE(touches(60, 24, 1, 0.445));
    EXPECT_TRUE(touches(118, 0, 0, 0.445));
}

TEST(PastEnd, ASinusFacesTheMouthOfACoronaryArtery) {
    OpenEnd end = end_of(Continuation::Root, 15);
    Vec3 u, v;
    tangent_basis(end.outward_normal, u, v);
    for (const double angle : {0.3, 1.4, 2.9, 4.4}) {
        end.faces = std::cos(angle) * u + std::sin(angle) * v;
        // The sinus is there; half a third farther round is the wall between two.
        const auto depth = [&](double turned) {
            return ask_past(end, place(end, 19, 15, angle + turned), 0.445).penetration;
        };
        EXPECT_LT(depth(0), -1) << angle;
        EXPECT_GT(depth(std::numbers::pi / 3), 1) << angle;
        EXPECT_NEAR(depth(0.4), depth(-0.4), 1e-9) << angle;
    }
}

TEST(PastEnd, ASheathHasItsBoreAndLength) {
    const OpenEnd end = end_of(Continuation::Sheath, 4);
    EXPECT_TRUE(ask_past(end, place(end, 6, 3), 0.4).touches());
    for (const double out : {1.0, 20.0, 109.0}) {
        EXPECT_FALSE(ask_past(end, place(end, out, 0), 0.84).touches()) << out;
        EXPECT_EQ(ask_past(end, place(end, out, 1.2), 0.445).touches(), out > 4) << out;
    }
    EXPECT_TRUE(ask_past(end, place(end, 112, 0), 0.445).touches());
}

TEST(PastEnd, IsOneTwiceDifferentiableFunctionOfSlopeOne) {
    for (const OpenEnd& end : all_ends()) {
        constexpr double h = 1e-5;
        double steepest = 0;
        const double narrows = [&] {
            double most = 0;
            const RoundCones cones = cones_past(end);
            for (const RoundCone& cone : cones.all()) most = std::max(most, cone.narrows);
            return most;
        }();
        all_over(end, 1, 4000, [&](const Vec3& x, auto&) {
            const WallContact c = ask_past(end, x);
            steepest = std::max(steepest, c.normal.norm());
            for (int d = 0; d < 3; ++d) {
                const Vec3 step = h * Vec3::Unit(d);
                const WallContact lower = ask_past(end, x - step), upper = ask_past(end, x + step);
                EXPECT_NEAR((upper.penetration - lower.penetration) / (2 * h), c.normal[d], 1e-6);
                EXPECT_LT(((upper.normal - lower.normal) / (2 * h) - c.curvature.col(d)).norm(),
                          1e-2 * std::max(1.0, c.curvature.norm()))
                    << (x - end.centre).transpose();
            }
        });
        EXPECT_LE(steepest, 1 + narrows + 1e-9);
        EXPECT_GT(steepest, 0.99);
    }
}

TEST(PastEnd, AJointTouchesNothingWithinItsTrust) {
    std::normal_distribution<double> bell;
    std::uniform_real_distribution<double> unit(0, 1);
    for (const OpenEnd& end : all_ends()) {
        int asked = 0;
        all_over(end, 2, 20000, [&](Vec3 x, std::mt19937& random) {
            if (random() % 4 == 0) x -= 2 * (x - end.centre).dot(end.outward_normal) * end.outward_normal;
            const double joint = 0.1 + 0.8 * unit(random);
            const WallContact c = ask_past(end, x, joint);
            if (c.trust <= 0) return;
            ++asked;
            for (int k = 0; k < 4; ++k) {
                const double far = k ? c.trust : c.trust * unit(random);
                const Vec3 to = x + far * Vec3(bell(random), bell(random), bell(random)).normalized();
                if ((to - end.centre).dot(end.outward_normal) <= 0) continue;  // the lumen's wall counts
                EXPECT_LE(ask_past(end, to, joint).penetration, 1e-9) << (x - end.centre).transpose();
            }
        });
        EXPECT_GT(asked, 100);
    }
}

/// A sphere wedged on the axis of a cone, where it is wider than that: it holds along the axis what
/// frictionless walls at the cone's angle a do, k·pen·sin a, its surface being pen within the wall.
TEST(PastEnd, AWedgedJointHoldsWhatAConeOfItsAngleDoes) {
    constexpr double stiffness = 5;
    int wedged = 0;
    for (const double end_radius : {1.2, 2.0, 4.5}) {
        const OpenEnd end = end_of(Continuation::Artery, end_radius);
        const double core = std::min(0.5, end_radius / 4),
                     a = std::atan((end_radius - 0.3 - 0.375 * core) / (14 * end_radius));
        for (const double joint : {0.45, 0.7, 1.0})
            for (double out = end_radius; out < 14 * end_radius; out += 0.3) {
                // On the axis the joint is wider by 3/8 of the core.
                const double lumen = end_radius - std::tan(a) * (out - 0.125 * end_radius),
                             pen = (joint + 0.375 * core - lumen) * std::cos(a);
                WallContact c = ask_past(end, place(end, out, 0), joint);
                c.stiffness = stiffness;
                EXPECT_EQ(c.touches(), pen > 0) << out;
                if (!c.touches()) continue;
                ++wedged;
                const double held = c.push().dot(end.outward_normal);
                EXPECT_NEAR(held, stiffness * pen * std::sin(a), 0.01 * held) << out;
                EXPECT_NEAR((c.push() - held * end.outward_normal).norm(), 0, 1e-9);
            }
    }
    EXPECT_GT(wedged, 100);
}
