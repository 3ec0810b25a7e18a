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
    using HandsTest::HandsTest;

    const exercise::Simulation& simulation() const { return exercise.simulation(); }
    const exercise::Inflation& inflation() const { return *simulation().treatment().inflation(); }
    double inside(script::DeviceRole role = script::DeviceRole::Balloon) const {
        return simulation().inserted(role);
    }
    double residual() const {
        double worst = 0;
        for (const physics::OpenedPlace& place : simulation().treatment().lesions()[0].places)
            worst = std::max(worst, 1 - place.radius / place.reference);
        return worst;
    }

    /// A frame in which these keys are down; what acts when pressed is pressed in the first of several.
    void hold(std::initializer_list<const char*> names, bool again) {
        Input input;
        std::vector<const char*> down(pedal);
        down.insert(down.end(), names);
        for (const char* name : down) {
            const Key key = find_key(name).value();
            for (std::size_t k = 0; k < map.injections.size(); ++k)
                if (!again && map.injections[k].key == key) input.injections.push_back(static_cast<int>(k));
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

    /// The recording gives the same states, frame for frame.
    void expect_replay(exercise::Exercise& again) const {
        const script::CommandScript script = script::parse_commands(recording, "hands");
        for (int k = 0; k < frames; ++k) {
            std::vector<script::Command> of_frame;
            for (const script::TimedCommand& timed : script.at(k)) of_frame.push_back(timed.command);
            again.next_frame(of_frame);
            ASSERT_EQ(again.simulation().state_hash(), states[static_cast<std::size_t>(k)]) << "frame " << k;
        }
    }

    std::vector<const char*> pedal;  // that a foot is on
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
    expect_replay(again);
}

/// The exercise as it ships. What is held stops where the eye would stop it: at a place, never at a frame.
class RenalStentByKeys : public TreatmentByKeys {
protected:
    RenalStentByKeys() : TreatmentByKeys(test::shipped_scenario("renal_stent"), exercise::Pictures::None) {}
};

TEST_F(RenalStentByKeys, FromTheFirstAortogramToTheLastTheExerciseIsDoneAndTheRecordingReplays) {
    using script::DeviceRole;
    const auto reaches = [&](std::initializer_list<const char*> keys, DeviceRole role, double place) {
        const bool in = inside(role) < place;
        return hold_until(keys, [&] { return in ? inside(role) >= place : inside(role) <= place; });
    };
    const auto aortogram = [&] {
        pedal = {"A"};
        for (int k = 0; k < 4; ++k) hold({}, false);
        press("F3");
        ASSERT_TRUE(simulation().contrast().injecting()) << messages.back().text;
        for (int k = 0; k < 16; ++k) hold({}, false);
        press("S");
        pedal.clear();
        press("R");
    };
    aortogram();

    // The guide: up to the artery's mouth, and turned until it springs in.
    pedal = {"Space"};
    press("C");
    ASSERT_EQ(hands.grasp()->in(Side::Left), DeviceRole::Catheter);
    ASSERT_TRUE(reaches({"E"}, DeviceRole::Catheter, 310.5));
    const double before = simulation().hand(DeviceRole::Catheter).turned;
    ASSERT_TRUE(hold_until({"W"}, [&] {
        return simulation().hand(DeviceRole::Catheter).turned - before > 108 * geometry::degree;
    }));

    // The wire, from a hand close to the valve, through the lesion.
    for (int k = 0; k < 20 && *simulation().gripped_at(DeviceRole::Wire) > 30; ++k) press("N");
    ASSERT_TRUE(reaches({"Up"}, DeviceRole::Wire, 343));

    // The helper holds the wire; the stent goes over it, and the guide back.
    press("Y");
    press("Tab");
    press("Tab");
    ASSERT_EQ(hands.grasp()->in(Side::Right), DeviceRole::Balloon) << hands.grasp()->sentence();
    ASSERT_EQ(hands.grasp()->in(Side::Left), DeviceRole::Catheter) << hands.grasp()->sentence();
    for (int k = 0; k < 20 && *simulation().gripped_at(DeviceRole::Balloon) > 20; ++k) press("N");
    ASSERT_TRUE(reaches({"Up"}, DeviceRole::Balloon, 335));
    ASSERT_TRUE(reaches({"D"}, DeviceRole::Catheter, 296.5));

    // Eleven atmospheres, without the beam while they act.
    ASSERT_TRUE(hold_until({"Semicolon"}, [&] { return inflation().wanted >= 11; }));
    ASSERT_TRUE(wait_until([&] { return inflation().pressure >= 11; }));
    pedal.clear();
    for (int k = 0; k < 120; ++k) hold({}, false);
    press("Apostrophe");
    ASSERT_TRUE(wait_until([&] { return inflation().pressure == 0; }));
    pedal = {"Space"};
    ASSERT_TRUE(reaches({"Down"}, DeviceRole::Balloon, 310));
    press("R");
    aortogram();

    EXPECT_TRUE(exercise.completed());
    const exercise::Score score = exercise.finish();
    ASSERT_TRUE(score.treatment);
    EXPECT_EQ(score.angiograms, 2);
    ASSERT_EQ(score.treatment->lesions.size(), 1u);
    const exercise::LesionScore& lesion = score.treatment->lesions[0];
    EXPECT_LT(lesion.after.residual, 30);
    EXPECT_LT(lesion.after.gradient().value_or(100), lesion.before.gradient().value_or(0) / 10);
    ASSERT_TRUE(lesion.stented);
    EXPECT_EQ(lesion.stented->covered, 100);
    EXPECT_NEAR(lesion.stented->protrusion.value_or(0), 2, 1.5);
    EXPECT_EQ(score.treatment->dissections + score.treatment->ruptures + score.treatment->bursts, 0);
    exercise::Exercise again(test::shipped_scenario("renal_stent"), exercise::Pictures::None, test::cache());
    expect_replay(again);
}

}  // namespace
}  // namespace room
