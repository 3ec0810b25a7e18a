#include "render/panel/contact_sheet.h"

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
    const auto brights_between = [&sheet](int left, int right) {
        int count = 0;
        for (int y = 4; y < 64; ++y) {
            for (int x = left; x < right; ++x) count += at(sheet, x, y) > 160;
        }
        return count;
    };
    EXPECT_GT(brights_between(4, 104), 60);
    EXPECT_EQ(brights_between(108, 208), 0);
}

TEST(ContactSheet, RefusesWhatCannotBeLaidOut) {
    const std::vector<GrayImage> one{plain(4, 4, 1)}, empty{GrayImage{}};
    EXPECT_THROW(render::contact_sheet({}, 1, 10), std::invalid_argument);
    EXPECT_THROW(render::contact_sheet(one, 0, 10), std::invalid_argument);
    EXPECT_THROW(render::contact_sheet(one, 1, 0), std::invalid_argument);
    EXPECT_THROW(render::contact_sheet(empty, 1, 10), std::invalid_argument);
}

}  // namespace
