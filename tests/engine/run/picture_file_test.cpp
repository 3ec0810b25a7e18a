#include "engine/run/picture_file.h"

#include "render/picture/png.h"
#include "tests/engine/fixtures.h"
#include "tests/render/images.h"

namespace run {

using PictureFile = test::InFolder;

TEST_F(PictureFile, ReplacesTheOldOneAndLeavesNothingBeside) {
    const render::ColourImage colour{5, 7, test::noisy(15, 7).pixels};
    write_picture(folder / "a.png", colour);
    EXPECT_EQ(render::read_colour_png(folder / "a.png"), colour);
    write_picture(folder / "a.png", test::noisy(37, 21));
    EXPECT_EQ(render::read_png(folder / "a.png"), test::noisy(37, 21));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST_F(PictureFile, NamesTheFolderItCannotWriteToAndLeavesTheOldFileWhole) {
    const std::string path = (folder / "missing/a.png").string();
    EXPECT_EQ(test::refusal([&] { write_picture(path, test::noisy(8, 8)); }),
              path + ": cannot be written: No such file or directory");
    std::filesystem::create_directories(folder / "taken.png/inside");
    EXPECT_NE(test::refusal([&] { write_picture(folder / "taken.png", test::noisy(8, 8)); }), "");

    write_picture(folder / "a.png", test::plain(8, 8, 3));
    EXPECT_THROW(write_picture(folder / "a.png", render::GrayImage{2, 2, {1, 2, 3}}), std::invalid_argument);
    EXPECT_EQ(render::read_png(folder / "a.png"), test::plain(8, 8, 3));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

}  // namespace run
