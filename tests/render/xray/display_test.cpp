#include "render/xray/display.h"

#include <cmath>
#include <gtest/gtest.h>

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
