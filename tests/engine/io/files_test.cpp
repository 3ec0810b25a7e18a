#include "engine/io/files.h"

#include <algorithm>
#include <csignal>
#include <fmt/format.h>
#include <iterator>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

#include "tests/engine/fixtures.h"

namespace io {

using Files = test::InFolder;

TEST_F(Files, WholeFileReplacesTheOldOneAndLeavesNothingBeside) {
    write_whole(folder / "a.txt", "one");
    write_whole(folder / "a.txt", "two");
    EXPECT_EQ(test::read(folder / "a.txt"), "two");
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt.part"));
}

TEST_F(Files, TextIsReadWholeAndWhatIsNoFileIsNamed) {
    test::write(folder / "a.txt", std::string("one\r\n\0two", 9));
    EXPECT_EQ(read_text(folder / "a.txt", "poem", "expected verses"), std::string("one\r\n\0two", 9));
    for (const std::filesystem::path& path : {folder / "none", folder / "."})
        EXPECT_EQ(test::refusal([&] { read_text(path, "poem", "expected verses"); }),
                  path.string() + ": no such poem can be read; expected verses");
}

TEST_F(Files, WhatAFileNamesLiesBesideIt) {
    const std::filesystem::path file = folder / "a.nhdr";
    for (const char* name : {"b.raw", "./b.raw", "inner/b.raw", "inner/../b.raw", "..b.raw", "inner/./b.raw"})
        EXPECT_EQ(file_beside(file, "data file", name),
                  folder / std::filesystem::path(name).lexically_normal());
    EXPECT_EQ(file_beside(file, "data file", (folder / "b.raw").string()), folder / "b.raw");
    EXPECT_EQ(file_beside("a.nhdr", "data file", "b.raw"), "b.raw");
    for (const std::string& name :
         std::initializer_list<std::string>{"../b.raw", "inner/../../b.raw", "/etc/passwd", "..", ".", "",
                                            "./..", "inner/../..", (folder / "../b.raw").string()})
        EXPECT_EQ(test::refusal([&] { file_beside(file, "data file", name); }),
                  file.string() + ": data file: '" + name.substr(0, 100) +
                      "' was found; expected a file beside this one, or in a folder beside it");
}

TEST_F(Files, FailedWriteNamesThePathAndTheReason) {
    test::write(folder / "file", "");
    test::expect_refusal([&] { write_whole(folder / "file/a.txt", "x"); },
                         "file/a.txt: cannot be written: Not a directory");
}

TEST_F(Files, FullDiskIsToldAndLeavesNothing) {
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
    test::expect_said(text, "a.txt: cannot be written: File too large");
    EXPECT_EQ(test::read(folder / "a.txt"), "old");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST_F(Files, LinksAndDevicesStayWhatTheyAre) {
    write_whole(folder / "target", "old");
    std::filesystem::create_symlink(folder / "target", folder / "link");
    write_whole(folder / "link", "new");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_EQ(test::read(folder / "target"), "new");
    std::filesystem::create_symlink("/dev/full", folder / "full");
    test::expect_refusal([&] { write_whole(folder / "full", "x"); }, "No space left");
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

TEST_F(Files, TheTargetOfALinkToNothingIsMade) {
    std::filesystem::create_directory(folder / "real");
    std::filesystem::create_symlink("real/x", folder / "first");
    std::filesystem::create_symlink(folder / "first", folder / "link");
    require_writable(folder / "link");
    EXPECT_FALSE(std::filesystem::exists(folder / "real/x"));
    write_whole(folder / "link", "new");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "first"));
    EXPECT_EQ(test::read(folder / "real/x"), "new");
    std::filesystem::create_symlink("circle", folder / "circle");
    EXPECT_NE(test::refusal([&] { write_whole(folder / "circle", "x"); }), "");
    std::filesystem::create_symlink("nowhere/x", folder / "lost");
    test::expect_refusal([&] { require_writable(folder / "lost"); }, "No such file");
}

TEST_F(Files, AnInputNamedLikeAPartIsLeftAlone) {
    test::write(folder / "a.txt.part", "mine");
    write_whole(folder / "a.txt", "x");
    EXPECT_EQ(test::read(folder / "a.txt.part"), "mine");
}

TEST_F(Files, GrowingFileShowsEachPieceAtOnce) {
    GrowingFile file(folder / "log");
    file.append("one\n");
    EXPECT_EQ(test::read(folder / "log"), "one\n");
    file.append("two\n");
    EXPECT_EQ(test::read(folder / "log"), "one\ntwo\n");
}

TEST_F(Files, GrowingFileOnAFullDiskIsTold) {
    GrowingFile file("/dev/full");
    test::expect_refusal([&] { file.append("x"); }, "No space left");
}

TEST_F(Files, GrowingFileHasOneWriter) {
    GrowingFile file(folder / "log");
    file.append("one\n");
    test::expect_refusal([&] { GrowingFile(folder / "log"); }, "another process is writing it");
    EXPECT_EQ(test::read(folder / "log"), "one\n");
}

TEST_F(Files, FifosDevicesAndSocketsAreRefusedBeforeTheyAreOpened) {
    ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string place = (folder / "s").string();
    ASSERT_LT(place.size(), sizeof address.sun_path);
    std::copy(place.begin(), place.end(), address.sun_path);
    ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    std::filesystem::create_symlink("/dev/zero", folder / "zero");
    // Opening a FIFO that nobody writes to would not return.
    for (const auto& [name, kind] : {std::pair{"fifo", "FIFO"}, {"s", "socket"}, {"zero", "device"}})
        EXPECT_EQ(test::refusal([&] { read_text(folder / name, "poem", "expected verses"); }),
                  fmt::format("{}: is a {}; expected a regular file", (folder / name).string(), kind));
    ::close(socket);
}

TEST_F(Files, HugeFileIsRefusedBeforeItIsRead) {
    test::write(folder / "a.txt", "");
    std::filesystem::resize_file(folder / "a.txt", largest_text + 1);  // takes no room on the disk
    test::expect_refusal([&] { read_text(folder / "a.txt", "poem", "expected verses"); },
                         "expected at most 2000 million");
}

TEST_F(Files, WhatCannotBeWrittenIsKnownBeforeAndNothingChanges) {
    test::write(folder / "a.txt", "old");
    for (const std::filesystem::path& path : {folder / "a.txt", folder / "new.txt"})
        EXPECT_EQ(test::refusal([&] { require_writable(path); }), "");
    EXPECT_EQ(test::read(folder / "a.txt"), "old");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
    for (const std::filesystem::path& path : {folder / "none/a.txt", folder / "a.txt/b.txt", folder / ".",
                                              std::filesystem::path("/proc/nope"), std::filesystem::path()})
        EXPECT_NE(test::refusal([&] { require_writable(path); }).find(": cannot be written: "),
                  std::string::npos)
            << path;
    // Opened for a moment, it would end what its reader gets.
    ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
    EXPECT_EQ(test::refusal([&] { require_writable(folder / "fifo"); }), "");
}

TEST_F(Files, LeftoversOfAProcessThatNobodyWaitedForAreRemoved) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(0);
    siginfo_t ended{};
    ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT), 0);  // a zombie now
    test::write(folder / fmt::format("a.png.{}.1.part", child), "");
    test::write(folder / fmt::format("a.png.{}.1.part", ::getpid()), "");
    remove_leftovers(folder.path());
    ::waitpid(child, nullptr, 0);
    EXPECT_FALSE(std::filesystem::exists(folder / fmt::format("a.png.{}.1.part", child)));
    EXPECT_TRUE(std::filesystem::exists(folder / fmt::format("a.png.{}.1.part", ::getpid())));
}

TEST(OwnFolder, SaysWhyAFolderWithinItCannotBeMade) {
    const test::TemporaryFolder folder;
    std::filesystem::create_symlink(folder / "nothing", folder / "frames");
    OwnFolder own(folder.path());
    EXPECT_EQ(test::refusal([&] { own.make("frames"); }),
              (folder / "frames").string() +
                  ": cannot be written: the output folder cannot be made: File "
                  "exists; expected a folder that can be written");
}

TEST(OwnFolder, SecondOneIsRefusedWithTheProcessOfTheFirst) {
    const test::TemporaryFolder folder;
    {
        const OwnFolder first(folder / "out");
        test::expect_refusal([&] { OwnFolder(folder / "out"); },
                             fmt::format("out: process {} is writing to this folder", ::getpid()));
        EXPECT_TRUE(std::filesystem::is_directory(folder / "out"));
        EXPECT_EQ(test::refusal([&] { OwnFolder(folder / "out", "other"); }), "");
    }
    const OwnFolder again(folder / "out");
}

TEST(OwnFolder, LockOfAKilledProcessHoldsNobodyBack) {
    const test::TemporaryFolder folder;
    const pid_t child = ::fork();
    if (child == 0) {
        const OwnFolder own(folder / "out");
        ::raise(SIGKILL);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(LockFile::owner(folder / "out/.seldinger.lock"), child);
    { const OwnFolder own(folder / "out"); }
    EXPECT_TRUE(std::filesystem::is_empty(folder / "out"));
}

TEST(OwnFolder, FoldersMadeForNothingGoAgainAndOthersStay) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "mine");
    {
        OwnFolder own(folder / "mine/a/b/");
        own.make("inner");
        EXPECT_TRUE(std::filesystem::is_directory(folder / "mine/a/b/inner"));
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder / "mine"));
    {
        OwnFolder own(folder / "mine/a");
        own.make("inner");
        test::write(folder / "mine/a/result", "x");
        own.keep();
    }
    EXPECT_TRUE(std::filesystem::is_directory(folder / "mine/a/inner"));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "mine/a"), {}), 2);
}

TEST(OwnFolder, PlaceThatCannotBeWrittenIsRefused) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "");
    for (const std::filesystem::path& path :
         {folder / "file", folder / "file/out", std::filesystem::path("/proc/nope")})
        EXPECT_NE(test::refusal([&] { OwnFolder own(path); }).find("the output folder cannot be made"),
                  std::string::npos)
            << path;
    test::expect_refusal([&] { OwnFolder own("/proc"); }, "cannot be written");
}

}  // namespace io
