/// Two hands, what is asked before an attempt ends, and what is shown for keys, by real keys.

#include <algorithm>
#include <map>

#include "app/play/window.h"
#include "tests/window/room.h"

namespace test {
namespace {

/// Frames in which the right hand pushes the wire while the left one pulls the catheter.
int frames_of_both(const script::CommandScript& script) {
    std::map<int, int> found;
    for (const script::TimedCommand& timed : script.commands) {
        if (const auto* in = std::get_if<script::Advance>(&timed.command))
            found[timed.frame] |= in->held == script::DeviceRole::Wire ? 1 : 0;
        if (const auto* out = std::get_if<script::Withdraw>(&timed.command))
            found[timed.frame] |= out->held == script::DeviceRole::Catheter ? 2 : 0;
    }
    return static_cast<int>(
        std::ranges::count_if(found, [](const auto& frame) { return frame.second == 3; }));
}

TEST(Play, BothHandsActAtOnceByKeysAndReplay) {
    TemporaryFolder other;
    write(other / "two.toml", read(asset("scenarios/s_bend.toml")) +
                                  "\n[catheter]\ndevice = \"berenstein5f\"\ninserted_mm = 30\n");
    const std::string scenario = (other / "two.toml").string();
    Room room(1280, 800, {scenario, "--free", "--record", "@run.gw"});
    const std::filesystem::path recording = room.folder / "run.gw";
    ASSERT_TRUE(room.start());
    room.display.key("space", true);
    room.display.key("Up", true);
    room.display.key("d", true);
    room.comes("both hands in ten frames", [&] { return frames_of_both(so_far(recording)) >= 10; });
    room.picture("two-hands");
    room.display.key("Up", false);
    room.display.key("d", false);
    room.picture_behind("h", 0.3, "help-two-hands");
    room.display.resize(640, 400);
    sleep_for(0.5);
    room.picture("two-hands-small");
    // The helper takes the wire, and lets it go: its valve has friction.
    room.display.tap("y");
    room.comes("the helper's wire", [&] {
        room.display.tap("y");
        return wait_until([&] { return read(recording).find(" pin wire off") != std::string::npos; }, 2);
    });
    EXPECT_EQ(room.close().code, 0);
    const Outcome replayed = replay(room, scenario);
    EXPECT_NE(replayed.out.find("all equal"), std::string::npos) << replayed.out << replayed.error;
}

TEST(Play, HomeAndEndAskAndNothingElseHappensMeanwhile) {
    Room room(640, 400, {"s_bend", "--record", "@run.gw"});
    const std::filesystem::path recording = room.folder / "run.gw";
    ASSERT_TRUE(room.start());
    room.display.key("Up", true);
    ASSERT_TRUE(room.records(recording, " advance "));
    room.display.key("Up", false);
    for (const auto& [key, picture] : {std::pair{"Home", "asks-again"}, {"End", "asks-end"}}) {
        room.display.tap(key);
        ASSERT_TRUE(room.reaches("asks"));
        sleep_for(0.5);
        room.picture(picture);
        const std::string before = read(recording);
        room.display.tap("Up", 0.3);
        for (const char* other : {"p", "F1", "Home", "End", "h", "r", "BackSpace"}) room.display.tap(other);
        sleep_for(0.7);
        EXPECT_EQ(read(recording), before) << "it waits";
        ASSERT_TRUE(room.tap_out_of("asks", "Escape"));
        ASSERT_TRUE(room.reaches("running"));
    }
    EXPECT_EQ(read(recording).find(" reset"), std::string::npos);
    room.display.tap("Home");
    ASSERT_TRUE(room.reaches("asks") && room.tap_out_of("asks", "Return"));
    ASSERT_TRUE(room.records(recording, " reset"));
    room.display.tap("h");
    sleep_for(0.4);
    room.picture("help-small");
    room.display.tap("h");
    EXPECT_EQ(read(recording).find(" inject"), std::string::npos);
    ASSERT_TRUE(room.finish());
    EXPECT_EQ(room.close().code, 0);
    const Outcome replayed = replay(room, "s_bend");
    EXPECT_NE(replayed.out.find("all equal"), std::string::npos) << replayed.out << replayed.error;
}

/// Places of keys stay; what is shown for them follows the layout, and a switch to another one.
TEST(Play, KeysAreShownAsTheyStandOnTheKeyboardInUse) {
    VirtualDisplay display(640, 480);
    setenv("DISPLAY", display.name().c_str(), 1);
    const auto choose = [](const char* layout) {
        return std::system(fmt::format("setxkbmap -layout {}", layout).c_str());
    };
    const auto shown = [](const char* key) {
        return app::Window::key_labels().at(static_cast<std::size_t>(*room::find_key(key)));
    };
    ASSERT_EQ(choose("fr,de"), 0);
    app::Window window(320, 240, "labels");
    EXPECT_EQ(shown("Q") + shown("W") + shown("A") + shown("Z"), "AZQW");
    EXPECT_EQ(shown("Semicolon"), "M");
    EXPECT_EQ(shown("2"), "é");
    EXPECT_EQ(shown("Up"), "Up");
    EXPECT_EQ(shown("Keypad4"), "Keypad4");
    display.switch_layout(1);
    for (int k = 0; k < 50 && shown("Y") != "Z"; ++k) window.wait(0.1);
    EXPECT_EQ(shown("Q") + shown("Y") + shown("Z"), "QZY");
}

}  // namespace
}  // namespace test
