#include "engine/io/files.h"

#include <csignal>
#include <iterator>
#include <sys/resource.h>

#include "tests/engine/fixtures.h"

namespace io {

TEST(Files, WholeFileReplacesTheOldOneAndLeavesNothingBeside) {
    const test::TemporaryFolder folder;
    write_whole(folder / "a.txt", "one");
    write_whole(folder / "a.txt", "two");
    EXPECT_EQ(test::read(folder / "a.txt"), "two");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt.part"));
}

TEST(Files, TextIsReadWholeAndWhatIsNoFileIsNamed) {
    const test::TemporaryFolder folder;
    test::write(folder / "a.txt", std::string("one\r\n\0two", 9));
    EXPECT_EQ(read_text(folder / "a.txt", "poem", "verses are accepted"), std::string("one\r\n\0two", 9));
    for (const std::filesystem::path& path : {folder / "none", folder / "."})
        EXPECT_EQ(test::refusal([&] { read_text(path, "poem", "verses are accepted"); }),
                  path.string() + ": no such poem can be read; verses are accepted");
}

TEST(Files, FailedWriteNamesThePathAndTheReason) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "");
    const std::string text = test::refusal([&] { write_whole(folder / "file/a.txt", "x"); });
    EXPECT_NE(text.find("file/a.txt: cannot be written: Not a directory"), std::string::npos) << text;
}

TEST(Files, FullDiskIsToldAndLeavesNothing) {
    const test::TemporaryFolder folder;
    write_whole(folder / "a.txt", "old");
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit none{0, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &none);
    const std::string text = test::refusal([&] {
        write_whole({{folder / "b.txt", ""}, {folder / "a.txt", "x"}});
    });
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_NE(text.find("a.txt: cannot be written: File too large"), std::string::npos) << text;
    EXPECT_EQ(test::read(folder / "a.txt"), "old");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(Files, LinksAndDevicesStayWhatTheyAre) {
    const test::TemporaryFolder folder;
    write_whole(folder / "target", "old");
    std::filesystem::create_symlink(folder / "target", folder / "link");
    write_whole(folder / "link", "new");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_EQ(test::read(folder / "target"), "new");
    std::filesystem::create_symlink("/dev/full", folder / "full");
    const std::string text = test::refusal([&] { write_whole(folder / "full", "x"); });
    EXPECT_NE(text.find("No space left"), std::string::npos) << text;
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

TEST(Files, AnInputNamedLikeAPartIsLeftAlone) {
    const test::TemporaryFolder folder;
    test::write(folder / "a.txt.part", "mine");
    write_whole(folder / "a.txt", "x");
    EXPECT_EQ(test::read(folder / "a.txt.part"), "mine");
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

}  // namespace io
