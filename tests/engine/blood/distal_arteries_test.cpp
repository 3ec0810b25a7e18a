#include <gtest/gtest.h>
#include <random>

#include "engine/blood/blood_flow.h"

namespace blood {
namespace {

Outlet outlet(double radius, double flow) {
    Outlet made{};
    made.end = "end";
    made.radius = radius;
    made.flow = flow;
    made.arterial = arterial_time(radius, flow);
    return made;
}

}  // namespace

TEST(DistalArteries, KeepAllThatEntersAtAnyFlow) {
    const std::vector<Outlet> outlets = {outlet(2.4, 8), outlet(1, 0.5)};
    DistalArteries arteries(outlets);
    std::mt19937 random(5);
    double in = 0, out = 0;
    for (int k = 0; k < 2000; ++k) {
        const double amount = random() % 3 == 0 ? 1e-3 * (random() % 1000) : 0,
                     flow = 1e-2 * (random() % 3000);
        in += amount;
        out += arteries.pass(k % 2, amount, flow, 1.0 / (1 + random() % 60));
        ASSERT_NEAR(in, out + arteries.held(0) + arteries.held(1), 1e-9);
    }
    EXPECT_GT(out, 0);
}

TEST(DistalArteries, DelayWithoutConcentrating) {
    const std::vector<Outlet> outlets = {outlet(2.4, 8)};
    DistalArteries arteries(outlets);
    const double dt = 1.0 / 60, concentration = 100;
    double time = 0, left = 0;
    float most = 0;
    while (left < 0.5 * concentration * 8 * dt && time < 10) {
        left = arteries.pass(0, concentration * 8 * dt, 8, dt);
        arteries.show();
        for (const float c : arteries.iodine()) most = std::max(most, c);
        time += dt;
    }
    EXPECT_NEAR(time, outlets[0].arterial, 0.1 * outlets[0].arterial);
    EXPECT_LE(most, concentration * 1.0001f);
    // Twice the flow takes half as long.
    arteries.reset();
    double fast = 0;
    left = 0;
    while (left < 0.5 * concentration * 16 * dt && fast < 10)
        left = arteries.pass(0, concentration * 16 * dt, 16, dt), fast += dt;
    EXPECT_NEAR(fast, time / 2, 0.15 * time);
}

TEST(DistalArteries, ANarrowArteryWithLittleFlowTakesLonger) {
    EXPECT_GT(arterial_time(3.5, 5.8), arterial_time(2.4, 8));
    EXPECT_EQ(arterial_time(2, 0), 0);
    DistalArteries still(std::vector<Outlet>{outlet(2, 0)});
    EXPECT_EQ(still.pass(0, 3, 0, 1), 3);  // straight to the organ
}

}  // namespace blood
