#include "engine/run/output_folder.h"

#include "tests/engine/fixtures.h"

namespace run {

TEST(OutputFolder, TakesOutAnEarlierRunAndLeavesOtherFiles) {
    const test::TemporaryFolder folder;
    for (const char* name : {"out/frames", "out/truth", "out/dicom"})
        std::filesystem::create_directories(folder / name);
    const char* const own[] = {"out/run.gw",
                               "out/score.json",
                               "out/frames/frame_000007.png",
                               "out/truth/frame_000007.json",
                               "out/truth/frame_000007_wire.png",
                               "out/truth/frame_000007_catheter.png",
                               "out/truth/frame_000007_vessels.png",
                               "out/dicom/xa_0001.dcm",
                               "out/dicom/xa_10000.dcm"};
    const char* const other[] = {"out/notes.txt", "out/frames/mine.png", "out/dicom/xa_1.dcm",
                                 "out/dicom/xa_0000.dcm", "out/dicom/patient.dcm"};
    for (const char* name : own) test::write(folder / name, "x");
    for (const char* name : other) test::write(folder / name, "x");
    OutputFolder out(folder / "out", OutputFolder::Parts{});
    for (const char* name : own) EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
    out.take_out_earlier_run();
    for (const char* name : own) EXPECT_FALSE(std::filesystem::exists(folder / name)) << name;
    for (const char* name : other) EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
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

TEST(OutputFolder, OwnCommandsAndExpectationAreNotOverwritten) {
    const test::TemporaryFolder folder;
    test::write(folder / "run.gw", "");
    EXPECT_NE(test::refusal([&] { refuse_to_overwrite(folder.path(), folder / "run.gw", {}); }), "");
    EXPECT_NE(test::refusal([&] { refuse_to_overwrite(folder.path(), "x.gw", folder.path()); }), "");
    EXPECT_EQ(test::refusal([&] { refuse_to_overwrite(folder / "new", folder / "run.gw", folder.path()); }),
              "");
}

}  // namespace run
