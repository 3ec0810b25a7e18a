/// Files of keys: what the shipped one says, and what is refused where.

#include "engine/room/keys.h"

#include <gtest/gtest.h>
#include <set>
#include <string_view>

#include "tests/engine/fixtures.h"

namespace room {
namespace {

using test::expect_said;
using test::refusal;

std::string said(const std::string& toml) {
    return refusal([&] { parse_keys(toml, "my.toml"); });
}

TEST(Keys, TheShippedFileGivesEveryActionAKeyAndNoneTwice) {
    const KeyMap map = load_keys(test::asset("keys.toml"));
    std::set<Key> seen;
    for (int k = 0; k < actions; ++k) {
        EXPECT_FALSE(map.keys[k].empty()) << info(static_cast<Action>(k)).key;
        for (const Key key : map.keys[k]) EXPECT_TRUE(seen.insert(key).second) << key_names()[key];
    }
    EXPECT_GE(map.injections.size(), 4u);
    for (const InjectionPreset& preset : map.injections)
        EXPECT_TRUE(seen.insert(preset.key).second) << preset.name;
    EXPECT_EQ(map.speeds.advance, (std::array<double, 3>{2, 10, 30}));
}

TEST(Keys, WhatIsWrongIsNamedWithItsLineAndWhatIsAccepted) {
    expect_said(said("[keys]\nadvance = \"Dovn\"\n"),
                "my.toml:2:11: 'Dovn' is no key (did you mean 'Down'?)");
    expect_said(said("[keys]\nadvance = \"Up\"\nwithdraw = [\"Down\", \"Up\"]\n"),
                "my.toml:3:21: 'Up' is given to 'advance' already");
    expect_said(said("[keys]\nadvence = \"Up\"\n"), "my.toml:2:");
    expect_said(said("[keys]\nadvance = 3\n"), "my.toml:2:11: this is no key");
    expect_said(said("[hand]\nadvance_mm_per_s = [2, 1, 30]\n"), "my.toml:2:");
    expect_said(said("[hand]\nadvance_mm_per_s = [2, 10, 1e9]\n"), "200");
    expect_said(said("[hand]\ngrip_step_mm = 0\n"), "my.toml:2:");
    expect_said(said("[hand]\nrun_up_s = nan\n"), "my.toml:2:");
    expect_said(said("[stand]\nfields_mm = [100, 200]\n"), "widest first");
    expect_said(said("[[injection]]\nname = \"no key\"\n"), "key");
    expect_said(said("[[injection]]\nkey = \"F1\"\nvolume_ml = -3\n"), "my.toml:3:");
    expect_said(said("[hand]\nmouse = \"both\"\n"), "my.toml:2:");
    expect_said(said("[[injection]]\nkey = \"F1\"\nby = \"pipette\"\n"), "my.toml:3:");
    expect_said(said("[[injection]]\nkey = \"F1\"\ninto = \"device\"\nrate_ml_per_s = 20\n"), "5");
    expect_said(said("[[injection]]\nkey = \"F1\"\nby = \"hand\"\nvolume_ml = 30\n"), "20");
    expect_said(said("[[injection]]\nkey = \"F1\"\nvolume_ml = 160\n"), "150");
    expect_said(said("[keys\n"), "my.toml:1:");
    test::expect_refusal([] { load_keys("/no/such.toml"); }, "/no/such.toml");
    // All of it at once.
    const std::string all = said("[keys]\nadvance = \"Upp\"\nwithdraw = \"Downn\"\n[hand]\nrun_up_s = -1\n");
    EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 2) << all;
}

TEST(Keys, WhatAFileNamesReplacesAndTheRestStays) {
    const KeyMap base = load_keys(test::asset("keys.toml"));
    const KeyMap map =
        parse_keys("[keys]\nadvance = [\"W\"]\nwithdraw = []\nrotate_left = \"Down\"\n", "mine", base);
    EXPECT_EQ(map.text(Action::Advance), "W");
    EXPECT_EQ(map.text(Action::Withdraw), "no key");
    EXPECT_EQ(map.text(Action::RotateLeft), "Down");
    EXPECT_EQ(map.text(Action::RotateRight), base.text(Action::RotateRight));
    EXPECT_EQ(map.injections.size(), base.injections.size());
    // A key that another action takes is gone from where it was.
    const KeyMap taken = parse_keys("[keys]\nmenu = \"F1\"\nhelp = \"Up\"\n", "mine", base);
    EXPECT_EQ(taken.text(Action::Advance), "no key");
    EXPECT_EQ(taken.injections.size(), base.injections.size() - 1);
}

/// What the manual says of the keys is what the shipped file and the help say.
TEST(Keys, TheManualHasThemAll) {
    const KeyMap map = load_keys(test::asset("keys.toml"));
    const std::string manual = test::read(std::filesystem::path(SELDINGER_SOURCE) / "docs/trainee/room.md");
    for (std::size_t t = 0; t < task_names.size(); ++t) {
        std::string table = fmt::format("### {}\n\n| Key | Effect |\n|---|---|\n", task_names[t]);
        const auto add = [&table](const std::string& key, std::string_view effect) {
            table += fmt::format("| **{}** | {} |\n", key, effect);
        };
        for (int k = 0; k < actions; ++k) {
            const auto action = static_cast<Action>(k);
            if (static_cast<std::size_t>(info(action).task) == t) add(map.text(action), info(action).help);
        }
        if (static_cast<Task>(t) == Task::Contrast)
            for (const InjectionPreset& preset : map.injections)
                add(map.label(preset.key), sentence_of(preset));
        test::expect_said(manual, table + "\n");
    }
}

TEST(Keys, WhatIsShownIsWhatStandsOnTheUsersKeyboard) {
    EXPECT_EQ(label_of("Q", "a"), "A");  // AZERTY
    EXPECT_EQ(label_of("Y", "z"), "Z");  // QWERTZ
    EXPECT_EQ(label_of("2", "\u00e9"), "\u00e9");
    EXPECT_EQ(label_of("Semicolon", "\u00f6"), "\u00f6");
    EXPECT_EQ(label_of("LeftBracket", "["), "[");
    EXPECT_EQ(label_of("M", ","), "Comma");        // AZERTY
    EXPECT_EQ(label_of("A", "\u03b1"), "\u03b1");  // Greek
    // Names stay where the system knows no sign, where the fonts have none, and where others have the same.
    EXPECT_EQ(label_of("F1", ""), "F1");
    EXPECT_EQ(label_of("A", "\u0444"), "A");  // Cyrillic
    EXPECT_EQ(label_of("A", "\xff"), "A");
    EXPECT_EQ(label_of("A", "\x01"), "A");
    EXPECT_EQ(label_of("Keypad4", "4"), "Keypad4");
    EXPECT_EQ(label_of("Space", " "), "Space");
    KeyMap map = load_keys(test::asset("keys.toml"));
    map.labels.assign(key_names().begin(), key_names().end());
    map.labels[static_cast<std::size_t>(*find_key("A"))] = "Q";
    EXPECT_EQ(map.first(Action::Acquisition), "Q");
    EXPECT_EQ(map.text(Action::Acquisition), "Q, GamepadB");
}

TEST(Keys, AGamepadInflatesAndDeflates) {
    const KeyMap map = load_keys(test::asset("keys.toml"));
    EXPECT_EQ(map.text(Action::Inflate), "Semicolon, KeypadAdd, GamepadDown");
    EXPECT_EQ(map.text(Action::Deflate), "Apostrophe, KeypadSubtract, GamepadLeftStick");
}

}  // namespace
}  // namespace room
