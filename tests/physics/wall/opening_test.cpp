/// Laws of a balloon, plaque, a vessel's wall and a stent at one place.

#include "physics/wall/opening.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace physics {
namespace {

BalloonLaw balloon() {
    BalloonLaw law;
    law.profile = 1.2;
    law.table = {{4, 3.8}, {8, 4.0}, {14, 4.2}};
    return law;
}

OpenedPlace place_of(double reference, double lumen) {
    OpenedPlace place;
    place.reference = reference;
    place.before = place.radius = place.largest = lumen;
    return place;
}

double unit(std::mt19937& random) {
    return std::ldexp(static_cast<double>(random()), -32);
}

}  // namespace

TEST(Opening, AVesselWithoutPlaqueTakesTheRadiusAtWhichItsWallAndTheBalloonBearThePressure) {
    const BalloonLaw law = balloon();
    const VesselLaw vessel;
    for (const double pressure : {2.0, 6.0, 10.0, 14.0}) {
        Loads loads{&law, pressure};
        const double r = balanced_radius(place_of(1.7, 1.7), {}, vessel, loads);
        EXPECT_NEAR(law.wall_pressure(2 * r) + vessel.pressure(r / 1.7 - 1), pressure, 1e-9);
    }
    // One that is wider than the balloon is not touched.
    Loads loads{&law, 8};
    EXPECT_DOUBLE_EQ(balanced_radius(place_of(3, 3), {}, vessel, loads), 3);
}

TEST(Opening, PlaqueIsOpenedAsFarAsTheClosedFormSaysAndRecoils) {
    const BalloonLaw law = balloon();
    for (const Plaque kind : {Plaque::Soft, Plaque::Fibrous, Plaque::Calcified}) {
        const PlaqueLaw plaque = law_of(kind);
        OpenedPlace place = place_of(2, 0.8);
        const double yields = 0.8 + 2 * plaque.yield / plaque.stiffness;
        const auto open_with = [&](double pressure) {
            const Loads loads{&law, pressure};
            for (int k = 0; k < 200; ++k) open_place(place, plaque, {}, loads, 0.05);
            return contact_pressure(loads, place.radius);
        };
        // Below its yield pressure it is elastic: nothing is left.
        const double contact = open_with(0.9 * plaque.yield);
        EXPECT_NEAR(place.radius, 0.8 + contact * 2 / plaque.stiffness, 1e-9);
        EXPECT_LT(place.radius, yields);
        open_with(0);
        EXPECT_NEAR(place.radius, 0.8, 1e-12);
        // Beyond it, as far as balloon, plaque and wall agree.
        const double more = open_with(plaque.yield + 4);
        const double r = place.radius, wall = VesselLaw().pressure(r / 2 - 1);
        EXPECT_NEAR(more - wall, plaque.yield + plaque.hardening * (r - yields) / 2, 1e-6);
        EXPECT_GT(r, 1.7);
        open_with(0);
        EXPECT_NEAR(place.radius, 0.8 + (1 - plaque.recoil) * (r - yields), 1e-9);
        // The second time it is torn, and opens as far with hardly any pressure.
        open_with(plaque.recoil_pressure + 2);
        EXPECT_GT(place.radius, 0.97 * r - 0.05);
    }
}

/// Work on the dial over a cycle is the area between the way up and the way down, in closed form.
TEST(Opening, TheWorkOfACycleIsWhatThePlaqueHasTakenUp) {
    const BalloonLaw law = balloon();
    const PlaqueLaw plaque = law_of(Plaque::Fibrous);
    OpenedPlace place = place_of(2.5, 0.8);
    double done = 0;
    constexpr int steps = 40000;
    for (int k = 0; k <= 2 * steps; ++k) {
        const double pressure = 10.0 * (k <= steps ? k : 2 * steps - k) / steps;
        const OpenedPlace before = place;
        open_place(place, plaque, {}, {&law, pressure}, 1);
        // Only what the pressure does against plaque: the balloon stores the rest and gives it back.
        const double area = std::numbers::pi * (place.radius * place.radius - before.radius * before.radius);
        done += 0.5 * (before.contact + place.contact) * area;
    }
    const double r0 = 0.8, R = 2.5, ry = r0 + R * plaque.yield / plaque.stiffness, rm = place.largest,
                 rc = r0 + (1 - plaque.recoil) * (rm - ry);
    // ∫ (a + b r) 2 π r dr
    const auto work = [](double a, double b, double from, double to) {
        const auto to_here = [&](double r) {
            return std::numbers::pi * (a * r * r + 2.0 / 3 * b * r * r * r);
        };
        return to_here(to) - to_here(from);
    };
    const double up = work(-plaque.stiffness * r0 / R, plaque.stiffness / R, r0, ry) +
                      work(plaque.yield - plaque.hardening * ry / R, plaque.hardening / R, ry, rm);
    const double slope = plaque.recoil_pressure / (rm - rc), down = work(-slope * rc, slope, rc, rm);
    ASSERT_LT(rm, R);
    EXPECT_GT(up - down, 10);
    EXPECT_NEAR(done, up - down, 1e-3 * (up - down));
}

TEST(Opening, AStentHoldsWhatItHasOpenedLessItsRecoil) {
    const BalloonLaw law = balloon();
    const PlaqueLaw plaque = law_of(Plaque::Fibrous);
    const StentLaw stent{false, 2.5, 0.04, 1.5, 0, 3};
    OpenedPlace bare = place_of(2, 0.8), stented = bare;
    stented.stent = 0.6;
    for (const double pressure : {13.0, 0.0})
        for (int k = 0; k < 300; ++k) {
            open_place(bare, plaque, {}, {&law, pressure}, 0.05);
            open_place(stented, plaque, {}, {&law, pressure, 1, &stent}, 0.05);
        }
    EXPECT_GT(stented.radius, 1.05 * bare.radius);
    EXPECT_LE(stented.radius, stented.stent);
    EXPECT_GT(stented.radius, 0.93 * stented.stent);
    // What it holds open, plaque presses on: both agree.
    const double holds = stented.stent * (1 - stent.recoil);
    EXPECT_NEAR(plaque.pressure(stented, stented.radius),
                stent.strength * std::min(1.0, (holds - stented.radius) / (0.05 * holds)), 1e-6);
}

TEST(Opening, ASelfExpandingStentOpensSlowlyAndKeepsMoreThanItOpens) {
    const PlaqueLaw plaque = law_of(Plaque::Soft);
    const StentLaw stent{true, 3, 0, 2, 0.8, 0};
    OpenedPlace place = place_of(2, 0.8);
    place.stent = 0.8;
    Loads loads;
    loads.stent = &stent;
    for (int k = 0; k < 300; ++k) open_place(place, plaque, {}, loads, 0.05);
    const double alone = place.radius;
    EXPECT_GT(alone, 0.81);
    EXPECT_LT(alone, 1.5);
    const BalloonLaw law = balloon();
    loads.balloon = &law, loads.pressure = 8;
    for (int k = 0; k < 300; ++k) open_place(place, plaque, {}, loads, 0.05);
    loads.balloon = nullptr;
    for (int k = 0; k < 300; ++k) open_place(place, plaque, {}, loads, 0.05);
    EXPECT_GT(place.radius, plaque.closes_to(place));
    EXPECT_GT(place.radius, alone + 0.5);
}

/// A larger pressure never gives a smaller radius; all stays finite, at rest once nothing changes, and no
/// narrower than it was; whatever the numbers.
TEST(Opening, AThousandRandomPlacesAreMonotoneAndComeToRest) {
    const unsigned seed = 20261129;
    std::mt19937 random(seed);
    for (int n = 0; n < 1000; ++n) {
        SCOPED_TRACE("seed " + std::to_string(seed) + ", place " + std::to_string(n));
        BalloonLaw law;
        law.profile = 0.6 + unit(random);
        double p = 0.2 + 6 * unit(random), d = law.profile + 5 * unit(random);
        for (int k = 0; k < 4; ++k)
            law.table.push_back({p += 0.1 + 5 * unit(random), d += 0.01 + unit(random)});
        const double reference = 0.5 + 5 * unit(random);
        const PlaqueLaw plaque{1 + 200 * unit(random), 20 * unit(random), 10 * unit(random), unit(random),
                               3 * unit(random)};
        const VesselLaw vessel{0.1 + unit(random), 2 + 15 * unit(random)};
        const StentLaw stent{random() % 2 == 0,      0.5 + 5 * unit(random), 0.2 * unit(random),
                             0.1 + 3 * unit(random), 0.1 * unit(random),     4 * unit(random)};
        OpenedPlace place = place_of(reference, reference * (0.05 + 0.95 * unit(random)));
        if (random() % 2 == 0) place.stent = place.radius;
        for (int k = 0; k < 60; ++k) {
            Loads loads;
            if (random() % 3 != 0) loads.balloon = &law, loads.pressure = 30 * unit(random);
            loads.fraction = unit(random);
            if (place.stent > 0) loads.stent = &stent;
            if (random() % 4 == 0) loads.device = 2 * unit(random);
            const double r = balanced_radius(place, plaque, vessel, loads);
            Loads more = loads;
            more.pressure += 5 * unit(random);
            ASSERT_GE(balanced_radius(place, plaque, vessel, more), r);
            open_place(place, plaque, vessel, loads, 0.2);
            ASSERT_TRUE(std::isfinite(place.radius) && std::isfinite(place.stent));
            ASSERT_GE(place.radius, place.before);
        }
        for (int k = 0; k < 400; ++k) open_place(place, plaque, vessel, {}, 0.2);
        const OpenedPlace rest = place;
        open_place(place, plaque, vessel, {}, 0.2);
        ASSERT_EQ(place, rest);
    }
}

}  // namespace physics
