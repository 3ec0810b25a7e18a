#include "engine/run/output_folder.h"

#include "tests/engine/fixtures.h"

namespace run {

TEST(OutputFolder, TakesOutAnEarlierRunAndLeavesOtherFiles) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directories(folder / "out/frames");
    for (const char* name : {"out/run.gw", "out/score.json", "out/frames/frame_000007.png", "out/notes.txt",
                             "out/frames/mine.png"}) {
        test::write(folder / name, "x");
    }
    OutputFolder out(folder / "out", OutputFolder::Parts{});
    EXPECT_FALSE(std::filesystem::exists(folder / "out/run.gw"));
    EXPECT_FALSE(std::filesystem::exists(folder / "out/frames/frame_000007.png"));
    EXPECT_TRUE(std::filesystem::exists(folder / "out/notes.txt"));
    EXPECT_TRUE(std::filesystem::exists(folder / "out/frames/mine.png"));
}

TEST(OutputFolder, GoesAgainWhenNothingWasKept) {
    const test::TemporaryFolder folder;
    { OutputFolder out(folder / "out", OutputFolder::Parts{}); }
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    {
        OutputFolder out(folder / "out", OutputFolder::Parts{});
        out.keep();
    }
    EXPECT_TRUE(std::filesystem::exists(folder / "out/frames"));
}

TEST(OutputFolder, PlaceBelowAFileIsRefused) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "");
    EXPECT_NE(test::refusal([&] {
                  OutputFolder out(folder / "file/out", OutputFolder::Parts{});
              }).find("cannot be made"),
              std::string::npos);
    EXPECT_NE(test::refusal([&] { OutputFolder out(folder / "file", OutputFolder::Parts{}); }), "");
}

TEST(OutputFolder, OwnCommandsAndExpectationAreNotOverwritten) {
    const test::TemporaryFolder folder;
    test::write(folder / "run.gw", "");
    EXPECT_NE(test::refusal([&] { refuse_to_overwrite(folder.path(), folder / "run.gw", {}); }), "");
    EXPECT_NE(test::refusal([&] { refuse_to_overwrite(folder.path(), "x.gw", folder.path()); }), "");
    EXPECT_EQ(test::refusal([&] { refuse_to_overwrite(folder / "new", folder / "run.gw", folder.path()); }),
              "");
}

}  // namespace run
