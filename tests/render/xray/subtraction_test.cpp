#include "render/xray/subtraction.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <stdexcept>

namespace {

using render::Field;
using render::Subtraction;

constexpr int size = 32, middle = 16 * size + 16;

/// A slope of signal, as bones make one, times `share` in a block amid it.
Field signal(float share) {
    Field field(size, size);
    for (int j = 0; j < size; ++j) {
        for (int i = 0; i < size; ++i) {
            const bool vessel = i >= 12 && i < 20 && j >= 12 && j < 20;
            field.values[j * size + i] = (1.0f + 0.1f * static_cast<float>(i)) * (vessel ? share : 1.0f);
        }
    }
    return field;
}

Subtraction subtraction() {
    return Subtraction(signal(1), Field(size, size, 1.0f));
}

}  // namespace

TEST(Subtraction, LeavesOnlyWhatChanged) {
    const render::SubtractionSpec spec;
    const render::GrayImage same = subtraction().subtracted(signal(1));
    for (const std::uint8_t grey : same.pixels) EXPECT_NEAR(grey, spec.dsa_background, 1);
    const render::GrayImage vessel = subtraction().subtracted(signal(0.5f));
    EXPECT_NEAR(vessel.pixels[middle], spec.dsa_background + spec.dsa_gain * std::log(0.5), 2);
    EXPECT_NEAR(vessel.pixels[31 * size + 31], same.pixels[31 * size + 31], 3);
}

TEST(Subtraction, BoneDoesNotPaleAVessel) {
    // Primary and scatter: where bone takes half of the primary, the scatter stays.
    const auto seen = [](bool vessel) {
        Field field(size, size);
        for (int j = 0; j < size; ++j) {
            for (int i = 0; i < size; ++i) {
                const float primary = i / 4 % 2 == 0 ? 1.0f : 0.5f;
                field.values[j * size + i] = primary * (vessel && j % 8 == 4 ? 0.6f : 1.0f) + 0.3f;
            }
        }
        return field;
    };
    const auto step = [&](double share) {
        render::SubtractionSpec spec;
        spec.scatter = share;
        const Subtraction masked(seen(false), Field(size, size, 1.0f), Field(size, size, 0.3f), spec);
        const Field difference = masked.difference(seen(true));
        return difference.values[20 * size + 14] / difference.values[20 * size + 18];
    };
    EXPECT_LT(step(0.0), 0.85);
    EXPECT_NEAR(step(0.95), 1.0, 0.02);
}

TEST(Subtraction, DenseContrastKeepsItsShadesAndGhostsDoNotDazzle) {
    // Ever less signal, and ever more.
    int before = 300;
    for (const float share : {1.4f, 1.2f, 1.0f, 0.7f, 0.5f, 0.35f, 0.25f, 0.18f, 0.12f}) {
        Field seen(size, size, share);
        const Subtraction masked(Field(size, size, 1.0f), Field(size, size, 1.0f));
        const int grey = masked.subtracted(seen).pixels[middle];
        EXPECT_LT(grey, before - 2) << share;
        EXPECT_GT(grey, 5);
        EXPECT_LT(grey, 255);
        before = grey;
    }
    Field nothing(size, size, 0.0f);
    EXPECT_LT(subtraction().subtracted(nothing).pixels[middle], 6);
}

TEST(Subtraction, AWireThatLeftShowsBright) {
    const Subtraction masked(signal(0.8f), Field(size, size, 1.0f));
    EXPECT_GT(masked.subtracted(signal(1)).pixels[middle],
              masked.subtracted(signal(0.8f)).pixels[middle] + 20);
}

TEST(Subtraction, RoadmapKeepsThePeakOfTheContrastUnderTheLiveWire) {
    Subtraction run = subtraction();
    EXPECT_FALSE(run.has_map());
    EXPECT_THROW(run.roadmap(signal(1)), std::logic_error);
    for (const float share : {1.0f, 0.4f, 0.4f, 0.4f, 0.4f, 0.4f, 0.4f, 0.9f, 1.0f})
        run.opacify(signal(share));
    Subtraction peak_only = subtraction();
    peak_only.opacify(signal(0.4f));
    EXPECT_LE(render::difference(run.roadmap(signal(1)), peak_only.roadmap(signal(1))).largest, 4);

    const render::GrayImage map = run.roadmap(signal(1)), wire = run.roadmap(signal(0.8f));
    EXPECT_GT(map.pixels[middle], map.pixels[0] + 40) << "vessels are bright";
    EXPECT_LT(wire.pixels[middle], map.pixels[middle] - 30) << "the wire is dark upon them";
}

TEST(Subtraction, IsBlackBehindTheCollimatorAndStandsNothingAndNaN) {
    Field open(size, size, 1.0f);
    open.values[0] = 0.0f;
    const Subtraction closed(signal(1), open);
    EXPECT_LT(closed.subtracted(signal(1)).pixels[0], 10);
    Field broken = signal(1);
    broken.values[1] = std::numeric_limits<float>::quiet_NaN();
    broken.values[2] = 0.0f;
    broken.values[3] = -5.0f;
    const render::GrayImage whole = closed.subtracted(signal(1)), holed = closed.subtracted(broken);
    EXPECT_EQ(holed.pixels[3], holed.pixels[2]);
    for (int i = 8 * size; i < size * size; ++i) ASSERT_NEAR(holed.pixels[i], whole.pixels[i], 3) << i;
}

TEST(Subtraction, MapsOfManyNoisyPulsesGatherLittleNoise) {
    // Without contrast the peak of many single pulses would rise with their number.
    const auto brightness = [](double share) {
        render::SubtractionSpec spec;
        spec.map_share = share;
        std::mt19937 random(8);
        std::normal_distribution<float> noise(1.0f, 0.1f);
        Subtraction run(Field(size, size, 1.0f), Field(size, size, 1.0f), spec);
        for (int pulse = 0; pulse < 20; ++pulse) {
            Field seen(size, size);
            for (float& value : seen.values) value = noise(random);
            run.opacify(seen);
        }
        double sum = 0;
        for (const std::uint8_t grey : run.roadmap(Field(size, size, 1.0f)).pixels) sum += grey;
        return sum / (size * size) - spec.roadmap_background;
    };
    EXPECT_GT(brightness(1.0), 5);
    EXPECT_LT(brightness(render::SubtractionSpec().map_share), 0.65 * brightness(1.0));
}
