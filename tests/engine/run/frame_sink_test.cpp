#include <csignal>
#include <sys/resource.h>

#include "engine/run/picture_file.h"
#include "render/picture/png.h"
#include "tests/engine/fixtures.h"
#include "tests/render/images.h"

namespace run {
TEST(FrameSink, NamesAreSixDigitsAndReadBack) {
    EXPECT_EQ(frame_file_name(123), "frame_000123.png");
    EXPECT_EQ(frame_of_file_name("frame_000123.png"), 123);
    EXPECT_EQ(frame_of_file_name("frame_123.png"), -1);
    EXPECT_EQ(frame_of_file_name("holiday.png"), -1);
    EXPECT_EQ(frame_of_file_name("frame_.png"), -1);
}

TEST(FrameSink, AllFramesAreThereWhenItHasFinished) {
    const test::TemporaryFolder folder;
    PngFolder sink(folder.path());
    for (int frame = 0; frame < 40; ++frame) sink.accept(frame, test::plain(8, 8, frame));
    sink.finish();
    for (int frame = 0; frame < 40; ++frame) {
        EXPECT_EQ(render::read_png(folder / frame_file_name(frame)), test::plain(8, 8, frame));
    }
}

TEST(FrameSink, FailureOnTheWorkerReachesTheCaller) {
    const test::TemporaryFolder folder;
    PngFolder sink(folder / "missing");
    test::expect_refusal(
        [&] {
            for (int frame = 0; frame < 40; ++frame) sink.accept(frame, test::plain(8, 8, 0));
            sink.finish();
        },
        "frame_000000.png");
}

TEST(FrameSink, FullDiskLeavesNoHalfFrame) {
    const test::TemporaryFolder folder;
    PngFolder sink(folder.path());
    // A limit on file size stands in for a full disk: the write stops part way.
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const rlimit tight{4096, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
    const std::string text = test::refusal([&] { sink.accept(0, test::noisy(256, 256)), sink.finish(); });
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    test::expect_said(text, "frame_000000.png: cannot be written: File too large");
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace run
