#include "render/xray/subtraction.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <stdexcept>

namespace {

using render::Field;
using render::Subtraction;

constexpr int size = 32, middle = 16 * size + 16;

/// A slope of signal, as bones make one, times `fraction` in a block amid it.
Field signal(float fraction) {
    Field field(size, size);
    for (int j = 0; j < size; ++j) {
        for (int i = 0; i < size; ++i) {
            const bool vessel = i >= 12 && i < 20 && j >= 12 && j < 20;
            field.values[j * size + i] = (1.0f + 0.1f * static_cast<float>(i)) * (vessel ? fraction : 1.0f);
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
    const auto step = [&](double fraction) {
        render::SubtractionSpec spec;
        spec.scatter = fraction;
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
    for (const float fraction : {1.4f, 1.2f, 1.0f, 0.7f, 0.5f, 0.35f, 0.25f, 0.18f, 0.12f}) {
        Field seen(size, size, fraction);
        const Subtraction masked(Field(size, size, 1.0f), Field(size, size, 1.0f));
        const int grey = masked.subtracted(seen).pixels[middle];
        EXPECT_LT(grey, before - 2) << fraction;
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
    for (const float fraction : {1.0f, 0.4f, 0.4f, 0.4f, 0.4f, 0.4f, 0.4f, 0.9f, 1.0f})
        run.opacify(signal(fraction));
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
    const auto brightness = [](double fraction) {
        render::SubtractionSpec spec;
        spec.map_fraction = fraction;
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
    EXPECT_LT(brightness(render::SubtractionSpec().map_fraction), 0.65 * brightness(1.0));
}

namespace {

/// A slope with a ridge of bone and a collimator, moved as a whole; a vessel at a place of its own.
Field moved_signal(double x, bool vessel) {
    Field field(64, 64);
    for (int j = 0; j < 64; ++j) {
        for (int i = 0; i < 64; ++i) {
            const double u = i - x;
            const bool in_vessel = vessel && j >= 30 && j < 34;
            field.values[j * 64 + i] = static_cast<float>(
                (1.0 + 0.6 * std::exp(-0.02 * (u - 30) * (u - 30))) * (in_vessel ? 0.5 : 1.0));
        }
    }
    return field;
}

int spread(const render::GrayImage& image, int row) {
    int low = 255, high = 0;
    for (int i = 10; i < 54; ++i) {
        low = std::min<int>(low, image.pixels[row * 64 + i]);
        high = std::max<int>(high, image.pixels[row * 64 + i]);
    }
    return high - low;
}

}  // namespace

TEST(Subtraction, AShiftedMaskFitsASignalThatMoved) {
    Subtraction seen(moved_signal(0, false), Field(64, 64, 1.0f));
    const render::GrayImage before = seen.subtracted(moved_signal(2.5, true));
    EXPECT_GT(spread(before, 10), 20);
    seen.shift_mask({2.5, 0}, false);
    EXPECT_LE(spread(seen.subtracted(moved_signal(2.5, true)), 10), 1);
    // Where the mask came from outside nothing is known.
    EXPECT_LT(seen.subtracted(moved_signal(2.5, true)).pixels[10 * 64 + 1], 6);
    seen.shift_mask({0, 0}, false);
    EXPECT_EQ(seen.subtracted(moved_signal(2.5, true)), before);
}

TEST(Subtraction, UnderARoadmapTheMapGoesWithTheMask) {
    const auto vessel_row = [](const render::GrayImage& image) {
        int brightest = 8;
        for (int j = 8; j < 56; ++j)
            if (image.pixels[j * 64 + 20] > image.pixels[brightest * 64 + 20]) brightest = j;
        return brightest;
    };
    Subtraction seen(moved_signal(0, false), Field(64, 64, 1.0f));
    seen.opacify(moved_signal(0, true));
    const int row = vessel_row(seen.roadmap(moved_signal(0, false)));
    Subtraction both = seen, alone = seen;
    both.shift_mask({0, 5}, true);
    alone.shift_mask({0, 5}, false);
    EXPECT_EQ(vessel_row(both.roadmap(moved_signal(0, false))), row + 5);
    EXPECT_EQ(vessel_row(alone.roadmap(moved_signal(0, false))), row);
    // A state keeps both shifts.
    Subtraction again;
    const std::vector<std::byte> state = geometry::state_of(both);
    geometry::restore_state(again, state);
    EXPECT_EQ(again.roadmap(moved_signal(0, false)), both.roadmap(moved_signal(0, false)));
    EXPECT_EQ(geometry::state_of(again), state);
    // The next pulse of DSA adds to the map where it was shown.
    both.opacify(moved_signal(0, false));
    EXPECT_EQ(vessel_row(both.roadmap(moved_signal(0, false))), row + 5);
}
