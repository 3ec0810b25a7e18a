#include "engine/blood/bore.h"

#include <gtest/gtest.h>
#include <random>

namespace blood {
namespace {

// The mean over the flow of a parabolic profile that contrast fills from the hub: nothing before half the
// volume has passed, then 1 − (V / 2 Q t)². Rings of equal area come within a ring's step of that.
TEST(Bore, GivesWhatAParabolicProfileGives) {
    Bore bore;
    bore.resize(1.2);
    constexpr double step = 0.01, concentration = 300;
    double pushed = 0;
    while (pushed < 4) {
        const double out = bore.push(step, concentration) / step;
        pushed += step;
        const double way = 1.2 / (2 * (pushed - 0.5 * step));
        const double expected = way >= 1 ? 0 : 1 - way * way;
        EXPECT_NEAR(out / concentration, expected, 0.17) << pushed;
        if (pushed < 0.5 * 1.2) {
            EXPECT_EQ(out, 0) << pushed;
        }
    }
}

// What goes in is inside or has come out, whatever the order of injections, flushes and wires.
TEST(Bore, KeepsCountOfItsIodine) {
    for (unsigned seed = 1; seed <= 1000; ++seed) {
        std::mt19937 random(seed);
        const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
        Bore bore;
        double in = bore.resize(0.01 + 2 * unit());
        double out = 0;
        for (int k = 0; k < 60; ++k) {
            if (random() % 5 == 0) out += bore.resize(0.01 + 2 * unit());
            const double volume = std::pow(10, -4 + 5 * unit()),
                         iodine = random() % 3 == 0 ? 0 : 400 * unit();
            in += volume * iodine;
            out += bore.push(volume, iodine);
            ASSERT_NEAR(out + bore.iodine(), in, 1e-9 * std::max(1.0, in)) << "seed " << seed;
            double mean = 0;
            for (const float there : bore.profile(50)) {
                ASSERT_GE(there, 0) << "seed " << seed;
                ASSERT_LE(there, 400.1) << "seed " << seed;
                mean += there / 50;
            }
            ASSERT_NEAR(mean * bore.volume(), bore.iodine(), 1e-4 * std::max(1.0, bore.iodine()))
                << "seed " << seed;
        }
    }
}

TEST(Bore, IsWashedBackToSalineButForAFilm) {
    Bore bore;
    bore.resize(1);
    bore.push(3, 320);
    EXPECT_GT(bore.profile(10).front(), 300);
    bore.push(1, 0);
    EXPECT_LT(bore.profile(10).front(), 0.3 * 320);
    bore.push(3, 0);
    EXPECT_LT(bore.iodine(), 0.15 * 320);
}

}  // namespace
}  // namespace blood
