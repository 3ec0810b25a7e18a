#include <gtest/gtest.h>
#include <stdexcept>
#include <vector>

#include "render/picture/resample.h"
#include "tests/render/images.h"

namespace {

using render::GrayImage;
using test::plain;

TEST(Resize, ReducesByTheMeanOverEachPixelsArea) {
    GrayImage stripes = plain(6, 2, 0);
    for (int x : {1, 3, 5}) stripes.pixels[x] = stripes.pixels[6 + x] = 200;
    EXPECT_EQ(render::resized(stripes, 3, 1).pixels, (std::vector<std::uint8_t>{100, 100, 100}));
    // 6 columns to 4: one and a half each.
    EXPECT_EQ(render::resized(stripes, 4, 1).pixels, (std::vector<std::uint8_t>{67, 67, 133, 133}));
}

TEST(Resize, EnlargesByInterpolation) {
    GrayImage step = plain(2, 1, 0);
    step.pixels[1] = 200;
    EXPECT_EQ(render::resized(step, 4, 1).pixels, (std::vector<std::uint8_t>{0, 50, 150, 200}));
    EXPECT_EQ(render::resized(step, 2, 1), step);
}

TEST(Resize, RefusesEmptySizesAndImages) {
    EXPECT_THROW(render::resized(plain(2, 2, 1), 0, 4), std::invalid_argument);
    EXPECT_THROW(render::resized(GrayImage{}, 4, 4), std::invalid_argument);
}

}  // namespace
