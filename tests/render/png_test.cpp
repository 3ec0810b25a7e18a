#include "render/png.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <iterator>
#include <png.h>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <unistd.h>

#include "tests/render/images.h"

namespace {

namespace fs = std::filesystem;
using render::GrayImage;
using render::test::noisy;

class Png : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("seldinger_png_test_" + std::to_string(::getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    static std::string message_of(const std::function<void()>& action) {
        try {
            action();
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    }

    fs::path folder_;
};

TEST_F(Png, ReadsBackWhatWasWritten) {
    const GrayImage image = noisy(37, 21);
    render::write_png(folder_ / "a.png", image);
    EXPECT_EQ(render::read_png(folder_ / "a.png"), image);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "nothing else is left in the folder";
}

TEST_F(Png, EqualImagesGiveEqualBytesAndReplaceAFile) {
    const GrayImage image = noisy(16, 16);
    EXPECT_EQ(render::encode_png(image), render::encode_png(image));
    render::write_png(folder_ / "a.png", noisy(8, 8));
    render::write_png(folder_ / "a.png", image);
    EXPECT_EQ(render::read_png(folder_ / "a.png"), image);
}

TEST_F(Png, NamesTheFolderItCannotWriteToAndLeavesNothing) {
    const fs::path path = folder_ / "missing" / "a.png";
    const std::string message = message_of([&] { render::write_png(path, noisy(8, 8)); });
    EXPECT_NE(message.find(path.string()), std::string::npos) << message;
    EXPECT_NE(message.find("No such file or directory"), std::string::npos) << message;
    EXPECT_TRUE(fs::is_empty(folder_));

    // The rename can fail too: the target is a folder that is not empty.
    fs::create_directories(folder_ / "taken.png" / "inside");
    EXPECT_NE(message_of([&] { render::write_png(folder_ / "taken.png", noisy(8, 8)); }), "");
    EXPECT_FALSE(fs::exists(folder_ / "taken.png.part"));
}

TEST_F(Png, AFullDiskIsAnErrorAndLeavesTheOldFileWhole) {
    const GrayImage old = noisy(8, 8);
    render::write_png(folder_ / "a.png", old);
    // A limit on file size stands in for a full disk: the write stops part way.
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    rlimit tight = before;
    tight.rlim_cur = 4096;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
    const std::string message = message_of([&] { render::write_png(folder_ / "a.png", noisy(256, 256)); });
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    EXPECT_NE(message.find("File too large"), std::string::npos) << message;
    EXPECT_FALSE(fs::exists(folder_ / "a.png.part"));
    EXPECT_EQ(render::read_png(folder_ / "a.png"), old);
}

TEST_F(Png, RefusesToReadWhatIsNotEightBitGrey) {
    const fs::path path = folder_ / "colour.png";
    png_image colour{};
    colour.version = PNG_IMAGE_VERSION;
    colour.width = colour.height = 2;
    colour.format = PNG_FORMAT_RGB;
    const std::uint8_t pixels[12] = {255};
    ASSERT_NE(png_image_write_to_file(&colour, path.c_str(), 0, pixels, 0, nullptr), 0);
    EXPECT_NE(message_of([&] { render::read_png(path); }).find("colour type 2"), std::string::npos);

    std::ofstream(folder_ / "text.png") << "not a picture";
    EXPECT_NE(message_of([&] { render::read_png(folder_ / "text.png"); }).find("text.png"),
              std::string::npos);
    EXPECT_NE(message_of([&] { render::read_png(folder_ / "none.png"); }).find("No such file"),
              std::string::npos);
}

TEST_F(Png, ColourReadsBackWhatWasWrittenAndIsNotTakenForGrey) {
    render::ColourImage image{37, 21, noisy(3 * 37, 21).pixels};
    render::write_png(folder_ / "c.png", image);
    EXPECT_EQ(render::read_colour_png(folder_ / "c.png"), image);
    EXPECT_EQ(render::encode_png(image), render::encode_png(image));
    EXPECT_NE(message_of([&] { render::read_png(folder_ / "c.png"); }).find("colour type 2"),
              std::string::npos);
    render::write_png(folder_ / "g.png", noisy(8, 8));
    const std::string message = message_of([&] { render::read_colour_png(folder_ / "g.png"); });
    EXPECT_NE(message.find("g.png: has colour type 0"), std::string::npos) << message;
    EXPECT_NE(message.find("(colour type 2) is read"), std::string::npos) << message;

    image.pixels.pop_back();
    EXPECT_THROW(render::encode_png(image), std::invalid_argument);
    EXPECT_THROW(render::write_png(folder_ / "c.png", render::ColourImage{}), std::invalid_argument);
    EXPECT_EQ(render::read_colour_png(folder_ / "c.png").width, 37) << "the old file is whole";
}

TEST_F(Png, RefusesADamagedFile) {
    std::vector<std::uint8_t> bytes = render::encode_png(noisy(64, 64));
    for (const std::size_t length : {bytes.size() / 2, std::size_t{30}, std::size_t{9}}) {
        std::ofstream(folder_ / "cut.png", std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(length));
        EXPECT_NE(message_of([&] { render::read_png(folder_ / "cut.png"); }), "") << length << " bytes";
    }
}

TEST_F(Png, RefusesAnImageWithoutPixels) {
    EXPECT_THROW(render::encode_png(GrayImage{}), std::invalid_argument);
    EXPECT_THROW(render::encode_png(GrayImage{2, 2, {1, 2, 3}}), std::invalid_argument);
}

}  // namespace
