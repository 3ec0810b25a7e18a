#include "physics/wire/outside_shaft.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "physics/relax/global_relaxer.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/feed.h"
#include "tests/physics/wires.h"

namespace physics {

/// Euler's elastica in closed form: hinged pieces of a fourth of the length, P/P_c = (2K/π)², Δ = 2(1 − E/K).
TEST(OutsideShaft, BearsWhatTheElasticaDoesPastItsCriticalLoad) {
    const OutsideShaft shaft{80, 0.7, 1e-6, 0};
    for (const double tip_angle : {10, 30, 50, 70}) {
        const double k = std::sin(0.5 * tip_angle * degree), K = std::comp_ellint_1(k),
                     E = std::comp_ellint_2(k);
        const double shorter = 2 * (1 - E / K), load = std::pow(2 * K / M_PI, 2);
        EXPECT_NEAR(shaft.push_at(shorter * shaft.length), shaft.critical * load, 0.01 * shaft.critical)
            << tip_angle << " degrees";
        EXPECT_NEAR(shaft.bow_at(shaft.critical * load), shorter * shaft.length, 0.02 * shaft.length)
            << tip_angle << " degrees";
    }
}

/// A clamped beam under its weight w and a push P, u = L/2 √(P/EI): its middle goes down by
/// wL⁴/384EI · 12 (2 − 2 cos u − u sin u)/(u³ sin u).
TEST(OutsideShaft, SagsAsABeamColumnDoes) {
    const double rigidity = 250, length = 300, weight = 4e-5;
    const double sag = weight * std::pow(length, 4) / (384 * rigidity);
    OutsideShaft shaft{length, euler_force(rigidity, length), sag, 0};
    EXPECT_NEAR(shaft.height(), sag, 1e-9);
    for (const double part : {0.2, 0.5, 0.8}) {
        shaft.bow = shaft.bow_at(part * shaft.critical);
        const double u = 0.5 * length * std::sqrt(part * shaft.critical / rigidity);
        const double grown = 12 * (2 - 2 * std::cos(u) - u * std::sin(u)) / (u * u * u * std::sin(u));
        EXPECT_NEAR(shaft.height(), sag * grown, 0.03 * sag * grown) << part;
    }
}

TEST(OutsideShaft, PushAndBowAreEachOthersInverseAndRise) {
    for (unsigned seed = 1; seed <= 1000; ++seed) {
        std::mt19937 random(seed);
        const auto in = [&](double low, double high) {
            return low * std::pow(high / low, random() / 4294967296.0);
        };
        const OutsideShaft shaft{in(5, 500), in(0.01, 20), in(1e-3, 10), 0};
        SCOPED_TRACE(seed);
        const double bow = in(1e-4, 1) * shaft.most_bow(), push = shaft.push_at(bow);
        EXPECT_NEAR(shaft.push_at(shaft.bow_at(push)), push, 1e-6 * shaft.critical);
        EXPECT_GT(shaft.push_at(1.01 * bow), push);
        const double step = 1e-5 * bow;
        const double slope = (shaft.push_at(bow + step) - shaft.push_at(bow - step)) / (2 * step);
        EXPECT_NEAR(shaft.stiffness_at(bow), slope, 1e-4 * slope);
        const double pull = -in(1e-3, 10) * shaft.critical;
        EXPECT_NEAR(shaft.push_at(shaft.bow_at(pull)), pull, 1e-6 * std::abs(pull));
    }
}

}  // namespace physics
