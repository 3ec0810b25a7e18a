#include "render/picture/png.h"

#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <png.h>
#include <stdexcept>
#include <string>
#include <zlib.h>

#include "tests/engine/fixtures.h"
#include "tests/render/images.h"

namespace {

namespace fs = std::filesystem;
using render::GrayImage;
using test::noisy;
using test::plain;

class Png : public test::InFolder {
protected:
    /// Of a picture, in a file.
    template <class Image>
    fs::path file(const Image& image, const std::string& name = "a.png") const {
        const std::vector<std::uint8_t> bytes = render::encode_png(image);
        std::ofstream(folder / name, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        return folder / name;
    }
};

TEST_F(Png, ReadsBackWhatWasWrittenOfAnySize) {
    for (const int width : {1, 2, 3, 7, 8, 9, 37, 256, 513}) {
        for (const int height : {1, 2, 3, 21, 129}) {
            const GrayImage image = noisy(width, height), flat = plain(width, height, 255);
            EXPECT_EQ(render::read_png(file(image)), image) << width << "x" << height;
            EXPECT_EQ(render::read_png(file(flat)), flat) << width << "x" << height;
            const render::ColourImage colour{width, height, noisy(3 * width, height).pixels};
            EXPECT_EQ(render::read_colour_png(file(colour)), colour) << width << "x" << height;
        }
    }
}

TEST_F(Png, EqualImagesGiveEqualBytes) {
    const GrayImage image = noisy(16, 16);
    EXPECT_EQ(render::encode_png(image), render::encode_png(image));
    const render::ColourImage colour{16, 5, noisy(48, 5).pixels};
    EXPECT_EQ(render::encode_png(colour), render::encode_png(colour));
}

TEST_F(Png, EveryChunkIsWhatTheSpecificationAsksFor) {
    const std::vector<std::uint8_t> bytes = render::encode_png(noisy(37, 21));
    const auto number = [&](std::size_t at) {
        return bytes[at] * 0x1000000ull + bytes[at + 1] * 0x10000 + bytes[at + 2] * 0x100 + bytes[at + 3];
    };
    EXPECT_EQ(png_sig_cmp(bytes.data(), 0, 8), 0);
    std::vector<std::string> types;
    std::size_t at = 8;
    while (at + 12 <= bytes.size()) {
        const std::size_t length = number(at);
        ASSERT_LE(at + 12 + length, bytes.size());
        types.emplace_back(bytes.begin() + at + 4, bytes.begin() + at + 8);
        EXPECT_EQ(number(at + 8 + length), crc32(0, &bytes[at + 4], static_cast<uInt>(length + 4)))
            << types.back();
        at += 12 + length;
    }
    EXPECT_EQ(at, bytes.size());
    EXPECT_EQ(types, (std::vector<std::string>{"IHDR", "IDAT", "IEND"}));
    EXPECT_EQ(number(16), 37u);
    EXPECT_EQ(number(20), 21u);
}

TEST_F(Png, RefusesToReadWhatIsNoPictureOrIsNotThere) {
    std::ofstream(folder / "text.png") << "not a picture";
    const auto refused = [&](const fs::path& path, const std::string& expected) {
        test::expect_refusal<std::runtime_error>([&] { render::read_png(path); }, expected);
    };
    refused(folder / "text.png", "text.png");
    refused(folder / "none.png", "No such file");
}

TEST_F(Png, ColourIsNotTakenForGreyNorGreyForColour) {
    const render::ColourImage colour{37, 21, noisy(3 * 37, 21).pixels};
    const fs::path coloured = file(colour, "c.png"), grey = file(noisy(8, 8), "g.png");
    test::expect_refusal<std::runtime_error>([&] { render::read_png(coloured); }, "colour type 2");
    for (const char* said : {"g.png: has colour type 0", "(colour type 2) is read"})
        test::expect_refusal<std::runtime_error>([&] { render::read_colour_png(grey); }, said);
}

TEST_F(Png, RefusesADamagedFile) {
    std::vector<std::uint8_t> bytes = render::encode_png(noisy(64, 64));
    for (const std::size_t length : {bytes.size() / 2, std::size_t{30}, std::size_t{9}}) {
        std::ofstream(folder / "cut.png", std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(length));
        EXPECT_NE(test::refusal<std::runtime_error>([&] { render::read_png(folder / "cut.png"); }), "")
            << length << " bytes";
    }
}

TEST_F(Png, RefusesAnImageWithoutPixels) {
    EXPECT_THROW(render::encode_png(GrayImage{}), std::invalid_argument);
    EXPECT_THROW(render::encode_png(GrayImage{2, 2, {1, 2, 3}}), std::invalid_argument);
    EXPECT_THROW(render::encode_png(render::ColourImage{}), std::invalid_argument);
    EXPECT_THROW(render::encode_png(render::ColourImage{2, 2, {1, 2, 3, 4}}), std::invalid_argument);
}

}  // namespace
