#include "render/picture/image.h"

#include <gtest/gtest.h>
#include <stdexcept>

namespace {

using render::GrayImage;

TEST(ImageDifference, CountsPixelsAndLevels) {
    const GrayImage a{2, 2, {10, 20, 30, 40}}, b{2, 2, {10, 25, 28, 40}};
    const render::ImageDifference apart = render::difference(a, b);
    EXPECT_DOUBLE_EQ(apart.mean, 7.0 / 4.0);
    EXPECT_DOUBLE_EQ(apart.largest, 5.0);
    EXPECT_EQ(apart.pixels_differing, 2);
}

TEST(ImageDifference, RefusesUnequalSizes) {
    const GrayImage a{2, 1, {1, 2}}, b{1, 2, {1, 2}};
    EXPECT_THROW(render::difference(a, b), std::invalid_argument);
}

}  // namespace
