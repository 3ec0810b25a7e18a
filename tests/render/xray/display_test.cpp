#include "render/xray/display.h"

#include <cmath>
#include <gtest/gtest.h>

#include "render/xray/detector.h"

namespace {

using render::Field;

TEST(Display, ShowsTheAverageSignalAtTheChosenGreyWhateverTheDose) {
    for (float quanta : {20.0f, 54.0f, 4000.0f}) {
        const Field even(128, 128, quanta);
        const render::DisplaySpec spec;
        const render::Display display(spec, even, Field(128, 128, 1.0f), Field(128, 128, 1.0f),
                                      Field(128, 128, 1.0f));
        EXPECT_NEAR(display.show(even).pixels[64 * 128 + 64], 255.0 * spec.brightness, 2.0);
    }
}

TEST(Display, FewQuantaAreNoSaltAndManyAreShownAsEver) {
    const int n = 128;
    // Bone in the middle of a body, from many quanta to hardly any.
    for (const float few : {0.1f, 1.0f, 4.0f, 12.0f}) {
        Field expected(n, n, 200.0f);
        const auto in_bone = [n](int i) {
            return std::abs(i % n - n / 2) < n / 4 && std::abs(i / n - n / 2) < n / 4;
        };
        for (int i = 0; i < n * n; ++i)
            if (in_bone(i)) expected.values[i] = few;
        const render::Display display({}, expected, Field(n, n, 1.0f), Field(n, n, 1.0f), Field(n, n, 1.0f));
        const render::GrayImage clean = display.show(expected),
                                noisy = display.show(render::read_out(expected, 0.58, {}, 1, 1));
        int salt = 0, pixels = 0;
        for (int i = 0; i < n * n; ++i) {
            if (!in_bone(i)) continue;
            ++pixels;
            salt += noisy.pixels[i] > clean.pixels[i] + 100;
        }
        EXPECT_LT(salt, 0.003 * pixels) << few << " quanta";
        EXPECT_LT(clean.pixels[n / 2 * n + n / 2], clean.pixels[n * n / 2 + 5]) << "bone is darker still";
    }
    // A wire halves many quanta: by the curve alone.
    const Field even(n, n, 24.0f);
    const render::DisplaySpec spec;
    const render::Display display(spec, even, Field(n, n, 1.0f), Field(n, n, 1.0f), Field(n, n, 1.0f));
    const double curve =
        1 / (1 + (1 - spec.brightness) / spec.brightness * std::exp(spec.contrast * std::log(2.0)));
    EXPECT_NEAR(display.show(Field(n, n, 12.0f)).pixels[n * n / 2], 255 * curve, 2.0);
}

TEST(Display, MoreSignalIsBrighterAndNothingOverflows) {
    const Field even(64, 64, 100.0f);
    const render::Display display({}, even, Field(64, 64, 1.0f), Field(64, 64, 1.0f), Field(64, 64, 1.0f));
    int before = 0;
    for (float signal : {-50.0f, 0.0f, 1.0f, 30.0f, 60.0f, 100.0f, 180.0f, 1e4f, 1e30f}) {
        const int grey = display.show(Field(64, 64, signal)).pixels[32 * 64 + 32];
        EXPECT_GE(grey, before);
        before = grey;
    }
    EXPECT_GT(before, 250);
}

TEST(Display, TakesOutWhatTheFlatFieldExplains) {
    Field flat(128, 128);
    for (int i = 0; i < 128 * 128; ++i) flat.values[i] = 0.6f + 0.4f * static_cast<float>(i % 128) / 128.0f;
    Field signal = flat;
    for (float& v : signal.values) v *= 300.0f;
    const auto shown =
        render::Display({}, signal, flat, Field(128, 128, 1.0f), Field(128, 128, 1.0f)).show(signal);
    EXPECT_NEAR(shown.pixels[64 * 128 + 10], shown.pixels[64 * 128 + 117], 1.0);
}

TEST(Display, ShuttersAreRoundSoftAndBlackOutside) {
    const render::DisplaySpec spec;
    const Field open = render::shutters(spec, {});
    EXPECT_EQ(open.values[0], 0.0f);
    EXPECT_EQ(open.values[256 * 512 + 2], 0.0f);
    EXPECT_EQ(open.values[256 * 512 + 256], 1.0f);
    EXPECT_EQ(open.values[14 * 512 + 256], 1.0f) << "a side is open";
    EXPECT_EQ(open.values[14 * 512 + 14], 0.0f) << "a corner is rounded off";
    int between = 0;
    for (int i = 0; i < 256; ++i)
        between += open.values[256 * 512 + i] > 0.0f && open.values[256 * 512 + i] < 1.0f;
    EXPECT_GE(between, 3);
    const Field even(64, 64, 100.0f);
    render::CArm small{.pixels = 64};
    EXPECT_LT(render::Display({}, even, Field(64, 64, 1.0f), Field(64, 64, 1.0f), render::shutters({}, small))
                  .show(even)
                  .pixels[0],
              10);
}

}  // namespace
