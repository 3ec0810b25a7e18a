#include "engine/run/headless.h"
#include "engine/run/picture_file.h"
#include "tests/engine/fixtures.h"
#include "tests/render/images.h"

namespace run {
namespace {

Expectation of_states(const std::string& text) {
    Expectation expectation;
    expectation.add_states(script::parse_commands(text, "old.gw"));
    return expectation;
}

}  // namespace

TEST(Expectation, EqualStatesDoNotDiffer) {
    Expectation expectation = of_states("state 3 000000000000000a\n");
    expectation.check_state(2, 0xb);
    expectation.check_state(3, 0xa);
    expectation.finish(5, false, true);
    EXPECT_TRUE(expectation.differences().empty());
    EXPECT_EQ(expectation.compared_states(), 1);
}

TEST(Expectation, DifferingStateIsToldWithItsLine) {
    Expectation expectation = of_states("\nstate 3 000000000000000a\n");
    expectation.check_state(3, 0xb);
    ASSERT_EQ(expectation.differences().size(), 1u);
    EXPECT_EQ(expectation.differences()[0],
              "old.gw:2:1: the state of frame 3 is 000000000000000b; 000000000000000a was expected");
}

TEST(Expectation, StateThatNeverCameDiffersUnlessInterrupted) {
    Expectation ended = of_states("state 9 000000000000000a\n"), interrupted = ended;
    ended.finish(5, false, true);
    EXPECT_EQ(ended.differences().size(), 1u);
    interrupted.finish(5, true, true);
    EXPECT_TRUE(interrupted.differences().empty());
}

TEST(Expectation, FramesOfAFolderAreComparedPixelByPixel) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "frames");
    test::write(folder / "run.gw", "state 1 000000000000000a\n");
    write_picture(folder / "frames/frame_000000.png", test::plain(8, 8, 5));
    write_picture(folder / "frames/frame_000001.png", test::plain(8, 8, 6));
    Expectation expectation;
    expectation.add(folder.path());
    expectation.check_frame(0, test::plain(8, 8, 5));
    EXPECT_TRUE(expectation.differences().empty());
    render::GrayImage changed = test::plain(8, 8, 6);
    changed.pixels[10] = 9;
    expectation.check_frame(1, changed);
    ASSERT_EQ(expectation.differences().size(), 1u);
    test::expect_said(expectation.differences()[0], "frame 1 differs at 1 pixels, by 3");
    EXPECT_EQ(expectation.compared_frames(), 2);
}

TEST(Expectation, ScriptWithoutStatesIsNoExpectation) {
    const test::TemporaryFolder folder;
    test::write(folder / "x.gw", "0 beam on\n");
    Expectation expectation;
    EXPECT_NE(test::refusal([&] { expectation.add(folder / "x.gw"); }), "");
}

TEST(Expectation, ImagesThatAreOnOneSideOnlyAreTold) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "frames");
    test::write(folder / "run.gw", "state 1 000000000000000a\n");
    write_picture(folder / "frames/frame_000002.png", test::plain(8, 8, 5));
    write_picture(folder / "frames/frame_000003.png", test::plain(8, 8, 5));
    Expectation expectation;
    expectation.add(folder.path());
    Expectation without_images = expectation;
    expectation.check_frame(0, test::plain(8, 8, 5));
    expectation.check_frame(2, test::plain(8, 8, 5));
    expectation.finish(5, false, true);
    ASSERT_EQ(expectation.differences().size(), 2u);
    test::expect_said(expectation.differences()[0], "1 of the frames, frame 0 first, have no image in");
    test::expect_said(expectation.differences()[1], "1 images of");
    test::expect_said(expectation.differences()[1], "frame 3 first, were not made by this run");
    without_images.finish(5, false, false);
    EXPECT_TRUE(without_images.differences().empty());
    ASSERT_EQ(without_images.notes().size(), 1u);
    test::expect_said(without_images.notes()[0], "its 2 images were not compared");
}

TEST(Expectation, ImagesThatWereTakenAwayAreADifference) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "frames");
    test::write(folder / "run.gw", "state 1 000000000000000a\n");
    const auto compared = [&](bool images) {
        Expectation expectation;
        expectation.add(folder.path());
        expectation.check_state(1, 10);
        expectation.check_frame(1, test::plain(8, 8, 5));
        expectation.finish(1, false, images);
        return expectation.differences();
    };
    EXPECT_TRUE(compared(true).empty());  // it never had any
    write_picture(folder / "sheet.png", test::plain(8, 8, 5));
    EXPECT_TRUE(compared(false).empty());
    ASSERT_EQ(compared(true).size(), 1u);
    test::expect_said(compared(true)[0], "none are left in frames/");
}

TEST(Expectation, ADamagedImageIsRefusedBeforeTheFirstFrame) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "frames");
    test::write(folder / "run.gw", "state 1 000000000000000a\n");
    test::write(folder / "frames/frame_000002.png", "no image");
    Expectation expectation;
    test::expect_refusal([&] { expectation.add(folder.path()); }, "frame_000002.png");
}

}  // namespace run
