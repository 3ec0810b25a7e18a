#include "engine/exercise/console.h"

#include <gtest/gtest.h>

namespace exercise {
namespace {

/// Pulses of the frames while the pedal is down.
std::vector<int> pulses(double rate, int frames) {
    Console console({}, 30);
    console.apply(script::SetPulseRate{rate});
    console.apply(script::Beam{true});
    std::vector<int> lit;
    for (int frame = 0; frame < frames; ++frame)
        if (console.end_frame().pulse) lit.push_back(frame);
    return lit;
}

}  // namespace

TEST(Console, PulsesComeAtTheirRateFromThePedalsFirstFrame) {
    EXPECT_EQ(pulses(30, 4), (std::vector<int>{0, 1, 2, 3}));
    EXPECT_EQ(pulses(15, 6), (std::vector<int>{0, 2, 4}));
    EXPECT_EQ(pulses(7.5, 10), (std::vector<int>{0, 4, 8}));
    EXPECT_EQ(pulses(3.75, 20), (std::vector<int>{0, 8, 16}));
}

TEST(Console, ThePedalStartsItsOwnClock) {
    Console console({}, 30, 7.5);
    EXPECT_FALSE(console.end_frame().pulse);
    console.apply(script::Beam{true});
    EXPECT_TRUE(console.end_frame().pulse);
    EXPECT_FALSE(console.end_frame().pulse);
    console.apply(script::Beam{false});
    EXPECT_FALSE(console.end_frame().pulse);
    console.apply(script::Beam{true});
    EXPECT_TRUE(console.end_frame().pulse);
    console.apply(script::Beam{true});
    EXPECT_FALSE(console.end_frame().pulse) << "a pedal that is down is not pressed again";
}

TEST(Console, TheTableMovesThePatientNotTheStand) {
    Console console({}, 15);
    const render::Pixel before = render::project(console.arm(), geometry::Vec3::Zero());
    console.apply(script::MoveTable{geometry::Vec3(30, 0, 0)});
    const render::Pixel after = render::project(console.arm(), geometry::Vec3::Zero());
    EXPECT_GT(after.x, before.x + 10) << "what moves to the patient's left moves to the viewer's right";
    EXPECT_NEAR(after.y, before.y, 1e-9);
    console.apply(script::MoveTable{});
    EXPECT_TRUE(console.arm() == render::CArm{});
}

TEST(Console, TheCollimatorKeepsTheFieldInPlace) {
    Console console({}, 15);
    console.apply(script::Collimate{120, 90});
    EXPECT_EQ(render::open_area(console.arm()), 120 * 90);
    console.apply(script::Collimate{script::widest_opening, script::widest_opening});
    EXPECT_EQ(render::open_area(console.arm()), 300 * 300);
}

}  // namespace exercise
