/// The teacher's window beside the trainee's, by real keys and a mouse.

#include "tests/window/room.h"

namespace test {
namespace {

constexpr int width = 900, height = 700;

/// The middle of the lowest button right of `left`; -1 where there is none.
std::pair<int, int> lowest_button(const render::ColourImage& image, int left) {
    const auto is_button = [&](int x, int y) {
        const std::uint8_t* pixel = &image.pixels[3 * (static_cast<std::size_t>(y) * image.width + x)];
        const auto is = [](int found, int wanted) { return std::abs(found - wanted) <= 3; };
        return is(pixel[0], button_ink.red) && is(pixel[1], button_ink.green) &&
               is(pixel[2], button_ink.blue);
    };
    for (int y = image.height - 1; y >= 0; --y)
        for (int x = left; x < image.width; ++x)
            if (is_button(x, y)) {
                int end = x;
                while (end + 1 < image.width && is_button(end + 1, y)) ++end;
                return {(x + end) / 2, y - 4};
            }
    return {-1, -1};
}

TEST(Teacher, WhatIsSaidAndSetBesideTheTraineeIsRecordedReplayedAndDebriefed) {
    Room room(width, height, {"s_bend", "--record", "@run.gw", "--teacher", "--teacher-size", "900x700"}, {},
              width);
    const std::filesystem::path recording = room.folder / "run.gw";
    ASSERT_TRUE(room.reaches("Teacher"));
    ASSERT_TRUE(room.start());
    ASSERT_TRUE(room.records(recording, "0 teacher window on"));
    room.display.key("space", true);
    room.display.key("Up", true);
    ASSERT_TRUE(room.records(recording, " advance "));
    room.display.key("Up", false);
    room.display.key("space", false);

    ASSERT_TRUE(room.display.find("Teacher"));
    room.display.give_focus();
    // A busy machine may lose a tap: begun anew then.
    ASSERT_TRUE(room.comes("a comment", [&] {
        room.display.tap("Escape");
        sleep_for(0.2);
        room.display.tap("Return");
        sleep_for(0.5);
        for (const char* letter : {"s", "l", "o", "w", "e", "r"}) room.display.tap(letter);
        room.display.tap("Return");
        return wait_until([&] { return read(recording).find(" slower\n") != std::string::npos; }, 3);
    }));
    room.picture("teacher-lesson");
    room.display.tap("F2");
    ASSERT_TRUE(room.comes("a complication", [&] {
        const auto [x, y] = lowest_button(room.display.screenshot(), 3 * width / 2);
        if (x >= 0) room.display.click(x, y);
        return wait_until(
            [&] { return read(recording).find(" complication spasm of ") != std::string::npos; }, 2);
    }));
    room.picture("teacher-patient");
    const std::string before = read(recording);
    for (const char* key : {"Up", "p", "End", "F1"}) room.display.tap(key);
    sleep_for(0.3);
    EXPECT_EQ(read(recording).find(" advance ", before.size()), std::string::npos)
        << "keys are of one window";
    expect_said(so_far(recording).origin->date ? "dated" : "", "dated");

    ASSERT_TRUE(room.display.find("Teacher"));
    room.display.close();
    ASSERT_TRUE(room.records(recording, " teacher window off"));
    ASSERT_TRUE(room.display.find("running"));
    room.display.give_focus();
    const auto has_window = [&] { return room.display.find("Teacher"); };
    ASSERT_TRUE(room.tap_until("F12", "the window again", has_window));
    ASSERT_TRUE(room.tap_until("F12", "its end", [&] { return !has_window(); }));
    ASSERT_TRUE(room.finish());
    ASSERT_TRUE(room.tap_until("F12", "the window on the last page", has_window));
    ASSERT_TRUE(room.display.find("Seldinger"));
    EXPECT_EQ(room.close().code, 0);

    const std::vector<std::string> cache = {"--cache", std::string(SELDINGER_SOURCE) + "/build/cache"};
    expect_said(run(room.folder, joined({"replay", recording}, cache)).out, "all equal");
    expect_said(run(room.folder, joined({"score", recording}, cache)).out, "window opened at 0:00");
    const std::filesystem::path page = room.folder / "page";
    const Outcome made =
        run(room.folder, joined({"debrief", recording, "--out", page, "--no-pictures"}, cache));
    EXPECT_EQ(made.code, 0) << made.error;
    expect_said(read(page / "debrief.html"), "slower</li>");
    expect_said(read(page / "debrief.html"), "spasm of the ");
}

}  // namespace
}  // namespace test
