#include "render/panel/contact_sheet.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/render/images.h"

namespace {

using render::GrayImage;
using test::plain;

int at(const GrayImage& image, int x, int y) {
    return image.pixels[static_cast<std::size_t>(y) * image.width + x];
}

TEST(ContactSheet, PlacesTilesRowByRowWithGaps) {
    const std::vector<GrayImage> images{plain(8, 4, 50), plain(8, 4, 100), plain(8, 4, 150)};
    const GrayImage sheet = render::contact_sheet(images, 2, 40);
    EXPECT_EQ(sheet.width, 2 * 44 + 4);
    EXPECT_EQ(sheet.height, 2 * 24 + 4);
    EXPECT_EQ(at(sheet, 4, 4), 50);
    EXPECT_EQ(at(sheet, 43, 23), 50);
    EXPECT_EQ(at(sheet, 44, 4), 0);
    EXPECT_EQ(at(sheet, 48, 4), 100);
    EXPECT_EQ(at(sheet, 4, 28), 150);
    EXPECT_EQ(at(sheet, 48, 28), 0) << "the fourth place stays empty";
}

TEST(ContactSheet, WritesEachLabelOnItsTileOnly) {
    const std::vector<GrayImage> images{plain(100, 60, 90), plain(100, 60, 90)};
    const std::vector<std::string> labels{"FRAME 12"};
    const GrayImage sheet = render::contact_sheet(images, 2, 100, labels);
    const auto whites_between = [&sheet](int left, int right) {
        int count = 0;
        for (int y = 4; y < 64; ++y) {
            for (int x = left; x < right; ++x) count += at(sheet, x, y) == 255;
        }
        return count;
    };
    EXPECT_GT(whites_between(4, 104), 60);
    EXPECT_EQ(whites_between(108, 208), 0);
}

TEST(ContactSheet, ReducesByTheMeanOverEachPixelsArea) {
    GrayImage stripes = plain(6, 2, 0);
    for (int x : {1, 3, 5}) stripes.pixels[x] = stripes.pixels[6 + x] = 200;
    EXPECT_EQ(render::resample(stripes, 3, 1).pixels, (std::vector<std::uint8_t>{100, 100, 100}));
    // 6 columns to 4: one and a half each.
    EXPECT_EQ(render::resample(stripes, 4, 1).pixels, (std::vector<std::uint8_t>{67, 67, 133, 133}));
}

TEST(ContactSheet, RefusesWhatCannotBeLaidOut) {
    const std::vector<GrayImage> one{plain(4, 4, 1)}, empty{GrayImage{}};
    EXPECT_THROW(render::contact_sheet({}, 1, 10), std::invalid_argument);
    EXPECT_THROW(render::contact_sheet(one, 0, 10), std::invalid_argument);
    EXPECT_THROW(render::contact_sheet(one, 1, 0), std::invalid_argument);
    EXPECT_THROW(render::contact_sheet(empty, 1, 10), std::invalid_argument);
}

TEST(ContactSheet, TextOutsideTheImageIsLeftOut) {
    GrayImage image = plain(10, 10, 0);
    render::draw_text(image, -3, -3, "888", 255);
    render::draw_text(image, 8, 8, "8", 255);
    EXPECT_GT(std::count(image.pixels.begin(), image.pixels.end(), 255), 0);
}

}  // namespace
