#include "engine/files.h"

#include "tests/engine/fixtures.h"

namespace engine {

TEST(Files, WholeFileReplacesTheOldOneAndLeavesNothingBeside) {
    const test::TemporaryFolder folder;
    write_whole(folder / "a.txt", "one");
    write_whole(folder / "a.txt", "two");
    EXPECT_EQ(test::read(folder / "a.txt"), "two");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt.part"));
}

TEST(Files, FailedWriteNamesThePathAndTheReason) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "");
    const std::string text = test::refusal([&] { write_whole(folder / "file/a.txt", "x"); });
    EXPECT_NE(text.find("file/a.txt: cannot be written: Not a directory"), std::string::npos) << text;
}

TEST(Files, FullDiskIsToldAndLeavesNothing) {
    const test::TemporaryFolder folder;
    std::filesystem::create_symlink("/dev/full", folder / "a.txt.part");
    const std::string text = test::refusal([&] { write_whole(folder / "a.txt", "x"); });
    EXPECT_NE(text.find("No space left"), std::string::npos) << text;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Files, GrowingFileShowsEachPieceAtOnce) {
    const test::TemporaryFolder folder;
    GrowingFile file(folder / "log");
    file.append("one\n");
    EXPECT_EQ(test::read(folder / "log"), "one\n");
    file.append("two\n");
    EXPECT_EQ(test::read(folder / "log"), "one\ntwo\n");
}

TEST(Files, GrowingFileOnAFullDiskIsTold) {
    GrowingFile file("/dev/full");
    EXPECT_NE(test::refusal([&] { file.append("x"); }).find("No space left"), std::string::npos);
}

}  // namespace engine
