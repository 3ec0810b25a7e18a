#include <array>

#include "engine/io/files.h"
#include "tests/engine/fixtures.h"

namespace io {

namespace fs = std::filesystem;

using Outputs = test::InFolder;

TEST_F(Outputs, AreTheSameFileUnderAnyName) {
    fs::create_directory(folder / "a");
    test::write(folder / "a/x", "");
    fs::create_directory_symlink("a", folder / "b");
    fs::create_symlink("y", folder / "a/z");
    fs::create_hard_link(folder / "a/x", folder / "a/hard");
    EXPECT_TRUE(same_file(folder / "a/x", folder / "b/x"));
    EXPECT_TRUE(same_file(folder / "a/x", folder / "a/hard"));
    EXPECT_TRUE(same_file(folder / "a/x", folder / "b/../a/x"));
    EXPECT_TRUE(same_file(folder / "a/y", folder / "b/z"));  // neither is there yet
    EXPECT_TRUE(same_file("x", fs::current_path() / "x"));
    EXPECT_FALSE(same_file(folder / "a/x", folder / "a/y"));
    EXPECT_FALSE(same_file("", ""));
}

TEST_F(Outputs, AreNeitherInputsNorWrittenTwice) {
    fs::create_directories(folder / "slices/more");
    test::write(folder / "slices/more/1", "");
    test::write(folder / "x", "");
    const auto refusal = [&](const std::vector<Output>& outputs) {
        const std::array inputs = {folder / "slices", folder / "x", fs::path()};
        return test::refusal([&] { require_distinct(outputs, inputs); });
    };
    EXPECT_EQ(refusal({{"--a", folder / "new"}, {"--b", folder / "slices/new"}, {"--c", ""}}), "");
    test::expect_said(refusal({{"--a", folder / "x"}}), "--a: ");
    test::expect_said(refusal({{"--a", folder / "x"}}), "x would overwrite what is read");
    test::expect_said(refusal({{"--a", folder / "slices/more/1"}}), "would overwrite what is read");
    test::expect_said(refusal({{"--a", folder / "new"}, {"--b", folder / "slices/../new"}}),
                      "would be written twice, by --a too");
}

}  // namespace io
