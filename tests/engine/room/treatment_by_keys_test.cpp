/// A whole treatment by keys: balloon, the change to a stent, the stent, and what is left of the lesion.

#include <fmt/format.h>

#include "engine/room/guide.h"
#include "engine/script/recording.h"
#include "tests/engine/room/hands_fixture.h"

namespace room {
namespace {

/// An artery of 6 mm with a lesion, a thin wire past it, and a balloon in it.
std::string artery() {
    std::string toml = test::replaced(test::small_toml, "radius_mm = 2.0", "radius_mm = 3.0");
    toml = test::replaced(toml, "{run_mm = 30.0}]", "{run_mm = 60.0}]");
    toml = test::replaced(toml, "inserted_mm = 20.0", "inserted_mm = 100.0");
    toml = test::replaced(toml, "device = \"glide035\"\nfrictionless = true\nbuckling_force_N = 0\n",
                          "device = \"v18\"\n");
    toml = test::replaced(toml, "torsion = \"rigid\"\n", "");
    return toml +
           "[balloon]\ndevice = \"pta6x20\"\ntray = [\"pta6x20\", \"stent6x18renal\"]\ninserted_mm = 81\n"
           "[[lesion]]\nbranch = \"tube\"\nat_mm = 62\nlength_mm = 12\npercent = 60\n";
}

class TreatmentByKeys : public HandsTest {
protected:
    TreatmentByKeys() : HandsTest(artery()) {}

    const exercise::Simulation& simulation() const { return exercise.simulation(); }
    const exercise::Inflation& inflation() const { return *simulation().treatment().inflation(); }
    double inside() const { return simulation().inserted(script::DeviceRole::Balloon); }
    double residual() const {
        double worst = 0;
        for (const physics::OpenedPlace& place : simulation().treatment().lesions()[0].places)
            worst = std::max(worst, 1 - place.radius / place.reference);
        return worst;
    }

    /// A frame in which these keys are down; what acts when pressed is pressed in the first of several.
    void hold(std::initializer_list<const char*> names, bool again) {
        Input input;
        for (const char* name : names) {
            const Key key = find_key(name).value();
            for (int k = 0; k < actions; ++k) {
                if (std::ranges::find(map.keys[k], key) == map.keys[k].end()) continue;
                const auto action = static_cast<Action>(k);
                if (action < first_pressed)
                    input.held.set(static_cast<std::size_t>(k));
                else if (!again)
                    input.pressed.push_back(action);
            }
        }
        const auto made = commands(input);
        for (const script::Command& command : made)
            recording += fmt::format("{} {}\n", frames, script::to_text(command));
        last = exercise.next_frame(made).motion;
        states.push_back(simulation().state_hash());
        ++frames;
    }
    void press(const char* name) {
        hold({name}, false);
        hold({}, false);
    }
    template <class Done>
    bool hold_until(std::initializer_list<const char*> names, const Done& done, int most = 600) {
        for (int k = 0; k < most && !done(); ++k) hold(names, k > 0);
        hold({}, false);
        return done();
    }
    bool wait_until(const std::function<bool()>& done) { return hold_until({}, done); }

    std::string recording;
    std::vector<std::uint64_t> states;
    int frames = 0;
};

TEST_F(TreatmentByKeys, APressOfTheHandleIsOneAtmosphereAndOneThatIsHeldGoesOn) {
    press("Semicolon");
    EXPECT_EQ(inflation().wanted, 1);
    press("Semicolon");
    EXPECT_EQ(inflation().wanted, 2);
    const int from = frames;
    ASSERT_TRUE(hold_until({"Semicolon"}, [&] { return inflation().wanted >= 6; }));
    const double seconds = (frames - from) / simulation().scenario().frame_rate;
    EXPECT_NEAR(seconds, 1.5, 0.2) << "3 atm at 2 atm/s after the first";
    press("Apostrophe");
    EXPECT_EQ(inflation().wanted, 0);
    ASSERT_TRUE(wait_until([&] { return inflation().pressure == 0; }));
}

TEST_F(TreatmentByKeys, WhatIsNotToBeDoneIsSaidAndNoCommandIsGiven) {
    press("Slash");
    test::expect_said(messages.back().text, "are inside: draw it back to the valve");
    EXPECT_EQ(recording, "");
    press("Semicolon");
    ASSERT_TRUE(wait_until([&] { return inflation().inflated(); }));
    press("Slash");
    test::expect_said(messages.back().text, "deflate it");
    press("0");
    test::expect_said(last.denied, "");
    test::expect_said(recording, "deploy");
    HandsTest::messages.clear();
    exercise::Exercise without(test::small_scenario(), true);
    Hands others(map, 1 / without.simulation().scenario().frame_rate);
    EXPECT_TRUE(others.commands(holding({Action::Inflate}), without.simulation(), {}, messages).empty());
    EXPECT_EQ(messages.back().text, "This exercise has neither balloon nor stent");
}

TEST_F(TreatmentByKeys, ALessonCountsWhatCameOfTheKeys) {
    const auto effects_in = [&](const Input& input) {
        const Situation before = situation_of(simulation(), hands.grasp());
        const std::vector<script::Command> given = commands(input);  // a frame refers to them
        const exercise::Frame made = exercise.next_frame(given);
        const Situation after = situation_of(simulation(), hands.grasp());
        return effects_of(before, after, input, made, map, false);
    };
    EXPECT_EQ(effects_in(holding({Action::Inflate}))[script::practice(Action::Inflate)], 1);
    EXPECT_EQ(effects_in(pressing({Action::Deflate}))[script::practice(Action::Deflate)], 1);
    EXPECT_EQ(effects_in(holding({Action::Deploy}))[script::practice(Action::Deploy)], 0) << "no stent";
    EXPECT_EQ(effects_in(pressing({Action::NextBalloon}))[script::practice(Action::NextBalloon)], 0);
    while (inside() > 20) frame(holding({Action::LeftWithdraw, Action::Fast}));
    Effects effects = effects_in(pressing({Action::NextBalloon}));
    for (int k = 0; k < 60 && effects[script::practice(Action::NextBalloon)] == 0; ++k)
        effects = effects_in(Input());
    EXPECT_EQ(effects[script::practice(Action::NextBalloon)], 1);
}

TEST_F(TreatmentByKeys, ATrayHasWhatTheCatalogueHasAndWhatFitsItsNeighbours) {
    const auto said = [](const std::string& tray) {
        const std::string toml = test::replaced(artery(), "[\"pta6x20\", \"stent6x18renal\"]", tray);
        return test::refusal([&] { exercise::Exercise(test::small_scenario(toml), true); });
    };
    EXPECT_EQ(said("[\"pta5x20\"]"), "");
    test::expect_said(said("[\"pta6x21\"]"), "did you mean 'pta6x20'?");
    test::expect_said(said("[\"cobra5f\"]"), "cobra5f");
    test::expect_said(said("\"pta6x20\""), "expected a list of balloons and stents");
    // The wire of 0.018 in is too thick for a balloon of coronary arteries.
    test::expect_said(said("[\"pta6x20\", \"cor30x15\"]"), "does not fit");
}

TEST_F(TreatmentByKeys, ABalloonThenAStentLeaveLessThanThirtyPercentAndTheRecordingReplays) {
    EXPECT_NEAR(residual(), 0.6, 0.05);
    const auto folded = [&] { return inflation().pressure == 0; };
    // The balloon, to its rated pressure.
    ASSERT_TRUE(hold_until({"Semicolon"}, [&] { return inflation().wanted >= 14; }));
    ASSERT_TRUE(wait_until([&] { return inflation().pressure >= 14; }));
    EXPECT_LT(residual(), 0.2);
    press("Apostrophe");
    ASSERT_TRUE(wait_until(folded));
    const double after_balloon = residual();
    EXPECT_LT(after_balloon, 0.45);
    // Out, and the stent in.
    ASSERT_TRUE(hold_until({"D", "LeftControl"}, [&] { return inside() < 20; }));
    press("Slash");
    ASSERT_TRUE(wait_until([&] { return inflation().device == "stent6x18renal"; }));
    ASSERT_TRUE(hold_until({"E"}, [&] { return inside() > 55; }));
    ASSERT_TRUE(hold_until({"E", "LeftShift"}, [&] { return inside() > 79.5; }));
    // The stent.
    press("0");
    ASSERT_TRUE(wait_until([&] { return inflation().pressure >= 9; }));
    for (int k = 0; k < 30; ++k) hold({}, false);
    press("Apostrophe");
    ASSERT_TRUE(wait_until(folded));
    ASSERT_EQ(simulation().treatment().stents().size(), 1u);
    EXPECT_FALSE(simulation().treatment().stents()[0].attached);
    EXPECT_LT(residual(), 0.3);
    EXPECT_LT(residual(), after_balloon);

    exercise::Exercise again(test::small_scenario(artery()), true);
    const script::CommandScript script = script::parse_commands(recording, "hands");
    for (int k = 0; k < frames; ++k) {
        std::vector<script::Command> of_frame;
        for (const script::TimedCommand& timed : script.at(k)) of_frame.push_back(timed.command);
        again.next_frame(of_frame);
        ASSERT_EQ(again.simulation().state_hash(), states[static_cast<std::size_t>(k)]) << "frame " << k;
    }
}

}  // namespace
}  // namespace room
