/// The first lesson, from its first step to its last, by real keys.

#include <nlohmann/json.hpp>

#include "tests/window/room.h"

namespace test {
namespace {

constexpr double a_while = 0.4;  // in which a fast hand, the C-arm or the table goes far enough [s]

/// The keys of a step: each is tapped for so long, while the others of its group are held.
struct Press {
    std::vector<std::string> held;
    std::string tapped;
    double seconds = 0.06;
};

struct LessonRoom : Room {
    LessonRoom() : Room(1280, 800, {"first_steps", "--learner", "ada", "--record", "@run.gw"}) {}

    bool has_done(int steps) { return display.find(fmt::format(" - {} of 37 steps", steps)); }
    void press(const Press& press) {
        for (const std::string& key : press.held) display.key(key, true);
        display.tap(press.tapped, press.seconds);
        sleep_for(press.seconds + 0.03);
        for (const std::string& key : press.held) display.key(key, false);
    }
    /// Presses until the lesson has the step, on however busy a machine.
    bool does(int step, const std::vector<Press>& presses) {
        return comes(fmt::format("step {}", step), [&] {
            for (const Press& one : presses) press(one);
            return wait_until([&] { return has_done(step); }, 1);
        });
    }
};

TEST(Lesson, FromFirstToLastStepByKeysIsKeptAndLeadsOn) {
    LessonRoom room;
    ASSERT_TRUE(room.start());
    ASSERT_TRUE(room.has_done(0));
    const std::vector<std::string> fast = {"Control_L"};
    const std::vector<std::vector<Press>> steps = {
        {{{}, "space", 0.8}},
        {{fast, "Up", a_while}, {fast, "Down", a_while}},
        {{{}, "Left", a_while}, {{}, "Right", a_while}},
        {{fast, "e", a_while}, {fast, "d", a_while}},
        {{{}, "q", a_while}, {{}, "w", a_while}},
        {{{"Shift_L"}, "Up", 0.9}, {fast, "Down", a_while}},
        {{{}, "n"}, {{}, "f"}},
        {{{}, "y"}},
        {{{}, "Tab"}, {{}, "c"}},
        {{{}, "g"}, {{}, "t"}},
        {{{}, "b"}},
        {{{}, "l", a_while}, {{}, "j", a_while}},
        {{{}, "i", a_while}, {{}, "k", a_while}},
        {{{}, "Prior", a_while}, {{}, "Next", a_while}},
        {{{}, "period", a_while}, {{}, "comma", a_while}},
        {{{}, "Insert", a_while}, {{}, "Delete", a_while}},
        {{{}, "u"}, {{}, "o"}},
        {{{}, "equal"}, {{}, "minus"}},
        {{{}, "bracketleft"}, {{}, "bracketright"}},
        {{{}, "7"}, {{}, "8"}, {{}, "6"}},
        {{{}, "9"}, {{}, "9"}},
        {{{"a"}, "Shift_R", 0.4}, {{"a"}, "F3", 0.6}},
        {{{}, "1"}, {{}, "2"}},
        {{{}, "3"}, {{}, "4"}},
        {{{}, "x"}, {{}, "z"}},
        {{{}, "s"}},
        {{{}, "r"}, {{}, "space", 0.6}},
        {{{"a"}, "Shift_R", 0.3}, {{"a"}, "m", 0.2}},
        {{{}, "5"}, {{"a"}, "Shift_R", 0.6}},
        {{{}, "F1"}},
        {{{}, "v", 0.1}, {{}, "v", 0.1}},
        {{{}, "p", 0.1}, {{}, "p", 0.1}},
        {{{}, "h", 0.1}, {{}, "h", 0.1}},
        {{{}, "Escape", 0.1}, {{}, "Escape", 0.1}},
        {{{}, "BackSpace"}},
    };
    for (std::size_t k = 0; k < steps.size(); ++k) {
        ASSERT_TRUE(room.does(static_cast<int>(k) + 1, steps[k]));
        if (k == 0 || k == 15 || k == 22) room.picture(fmt::format("lesson-{}", k + 2));
    }
    room.display.tap("Home");
    ASSERT_TRUE(room.reaches("asks"));
    ASSERT_TRUE(room.tap_out_of("asks", "Return"));
    ASSERT_TRUE(room.comes("the new attempt", [&] { return room.has_done(36); }));
    room.display.key("Control_L", true);
    room.display.key("Up", true);
    ASSERT_TRUE(room.comes("the target", [&] { return room.display.find("ended") || room.has_done(37); }));
    room.display.key("Up", false);
    room.display.key("Control_L", false);
    ASSERT_TRUE(room.reaches("ended"));

    const std::filesystem::path results = room.folder / "data/seldinger/recordings/ada/results.json";
    ASSERT_TRUE(room.comes("the result", [&] { return !read(results).empty(); }));
    const nlohmann::json kept = nlohmann::json::parse(read(results)).at("first_steps");
    EXPECT_EQ(kept.at("passed"), 1);
    EXPECT_EQ(kept.at("steps_done"), 37);
    EXPECT_NE(read(room.folder / "run.gw").find("\nlesson 37 of 37\n"), std::string::npos);
    sleep_for(0.3);
    room.picture("lesson-end");
    ASSERT_TRUE(room.mark_next("Right"));  // "Next exercise"
    ASSERT_TRUE(room.tap_out_of("first_steps", "Return"));
    EXPECT_TRUE(room.reaches("straight"));
    EXPECT_EQ(room.close().code, 0);
}

/// What was left out is no step that was done: the target alone passes nothing.
TEST(Lesson, StepsLeftOutDoNotPass) {
    LessonRoom room;
    ASSERT_TRUE(room.start());
    ASSERT_TRUE(room.does(1, {{{}, "space", 0.8}}));
    // More than there are steps: a busy machine may lose some.
    for (int k = 0; k < 60; ++k) room.display.tap("backslash");
    // In short pushes, between which the tip may come to rest in the target, on however busy a machine.
    ASSERT_TRUE(room.comes("the target", [&] {
        room.press({{}, "Up", 0.3});
        return wait_until([&] { return room.display.find("ended"); }, 0.7);
    }));
    ASSERT_TRUE(room.reaches("ended"));
    const std::filesystem::path results = room.folder / "data/seldinger/recordings/ada/results.json";
    ASSERT_TRUE(room.comes("the result", [&] { return !read(results).empty(); }));
    const nlohmann::json kept = nlohmann::json::parse(read(results)).at("first_steps");
    EXPECT_EQ(kept.at("reached"), 1);
    EXPECT_EQ(kept.at("passed"), 0);
    EXPECT_EQ(kept.at("steps_done"), 2);  // the first, and the target
    EXPECT_EQ(room.close().code, 0);
}

}  // namespace
}  // namespace test
