#include "engine/exercise/monitor.h"

#include <cmath>
#include <gtest/gtest.h>

#include "engine/studies/picture_measures.h"

namespace exercise {
namespace {

using geometry::Vec3;

constexpr int side = 256;  // [pixels]

/// A wire up and down at that distance to the left of the middle [mm].
Pulse pulse(int frame, double left) {
    Pulse made;
    made.arm = {.detector_width = 150.0, .pixels = side};
    PulsedDevice wire;
    for (int i = -30; i <= 30; ++i) wire.joints.emplace_back(left, 0.0, 1.0 * i);
    made.devices.push_back(wire);
    made.exposure.frame = static_cast<std::uint64_t>(frame);
    made.exposure.kvp = 70;
    made.time = {frame, frame, frame / 15.0};
    return made;
}

/// Grey levels that columns around a place are darker by than those beside them.
double dark_at(const render::GrayImage& image, double left) {
    const render::CArm arm{.detector_width = 150.0, .pixels = side};
    const int middle = static_cast<int>(render::project(arm, Vec3(left, 0, 0)).x);
    double on = 0, beside = 0;
    for (int row = side / 2 - 20; row < side / 2 + 20; ++row)
        for (int k = -1; k <= 1; ++k) {
            on += image.pixels[static_cast<std::size_t>(row * side + middle + k)] / 120.0;
            beside +=
                image.pixels[static_cast<std::size_t>(row * side + middle + k + (k < 0 ? -12 : 12))] / 120.0;
        }
    return beside - on;
}

double noise(const render::GrayImage& image) {
    render::Field grey(side, side);
    for (std::size_t i = 0; i < grey.values.size(); ++i) grey.values[i] = image.pixels[i];
    return studies::noise_of(studies::inner_part(grey, 0.15));
}

// Of four pulses with weights 0.6, 0.24, 0.096 and 0.064, where nothing moves.
TEST(Monitor, MixesPulsesAgainstNoise) {
    Monitor monitor{render::Fluoroscope({}, {})};
    monitor.take(pulse(0, 10));
    const double one = noise(*monitor.image());
    for (int frame = 1; frame < 6; ++frame) monitor.take(pulse(frame, 10));
    ASSERT_GT(one, 1);
    EXPECT_NEAR(noise(*monitor.image()) / one, std::sqrt(0.431), 0.08);
}

TEST(Monitor, LeavesNoTrailOfAWireThatMoves) {
    Monitor monitor{render::Fluoroscope({}, {})};
    for (int frame = 0; frame < 5; ++frame) monitor.take(pulse(frame, 10));
    const double depth = dark_at(*monitor.image(), 10);
    ASSERT_GT(depth, 10);
    monitor.take(pulse(5, 0));
    EXPECT_LT(std::abs(dark_at(*monitor.image(), 10)), 0.12 * depth);
    EXPECT_GT(dark_at(*monitor.image(), 0), 0.85 * depth);
}

}  // namespace
}  // namespace exercise
