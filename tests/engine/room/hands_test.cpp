/// Hands, pedals and stand: what is held and pressed becomes the commands of a frame.

#include "engine/room/hands.h"

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "engine/exercise/exercise.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

using exercise::StepReport;

class HandsTest : public testing::Test {
protected:
    explicit HandsTest(const std::string& toml = test::small_toml)
        : exercise(test::small_scenario(toml), true),
          map(load_keys(test::asset("keys.toml"))),
          hands(map, 1 / exercise.simulation().scenario().frame_rate) {}

    std::vector<script::Command> commands(const Input& input) {
        return hands.commands(input, exercise.simulation(), last, messages);
    }
    void frame(const Input& input) { last = exercise.next_frame(commands(input)).motion; }
    static Input holding(std::initializer_list<Action> held) {
        Input input;
        for (const Action action : held) input.held.set(static_cast<std::size_t>(action));
        return input;
    }
    static Input pressing(std::initializer_list<Action> pressed) {
        Input input;
        input.pressed = pressed;
        return input;
    }

    exercise::Exercise exercise;
    KeyMap map;
    Hands hands;
    StepReport last;
    std::vector<std::string> messages;
};

template <class Kind>
const Kind* find(const std::vector<script::Command>& commands) {
    for (const script::Command& command : commands)
        if (const Kind* found = std::get_if<Kind>(&command)) return found;
    return nullptr;
}

TEST_F(HandsTest, AHeldKeyRunsUpToItsSpeedAndFineAndFastAreTheirs) {
    const double rate = exercise.simulation().scenario().frame_rate;
    double before = 0;
    for (int k = 0; k < 20; ++k) {
        const auto made = commands(holding({Action::Advance}));
        const auto* advance = find<script::Advance>(made);
        ASSERT_TRUE(advance);
        EXPECT_GE(advance->length, before);
        before = advance->length;
    }
    EXPECT_NEAR(before, 10 / rate, 1e-3);
    EXPECT_NEAR(find<script::Advance>(commands(holding({Action::Advance, Action::Fine})))->length, 2 / rate,
                1e-3);
    EXPECT_NEAR(find<script::Advance>(commands(holding({Action::Advance, Action::Fast})))->length, 30 / rate,
                1e-3);
    // Let go and pressed again, it starts slowly.
    EXPECT_TRUE(commands(Input()).empty());
    EXPECT_LT(find<script::Advance>(commands(holding({Action::Advance})))->length, 0.5 * before);
    EXPECT_TRUE(find<script::Withdraw>(commands(holding({Action::Withdraw}))));
    EXPECT_TRUE(commands(holding({Action::Advance, Action::Withdraw})).empty());
}

TEST_F(HandsTest, WheelDragAndStickMoveTheWire) {
    Input input;
    input.wheel = -2;
    EXPECT_NEAR(find<script::Withdraw>(commands(input))->length, 2 * map.speeds.wheel, 1e-9);
    input = Input();
    input.drag_right = 10;
    EXPECT_NEAR(find<script::Rotate>(commands(input))->angle, 5 * std::numbers::pi / 180, 1e-4);
    input = Input();
    input.push[0] = 1;
    EXPECT_NEAR(find<script::Advance>(commands(input))->length,
                10 / exercise.simulation().scenario().frame_rate, 1e-3);
    input.push[0] = map.speeds.dead_zone / 2;
    EXPECT_TRUE(commands(input).empty());
}

TEST_F(HandsTest, PedalsTurnTheBeamOnWhileTheyAreDown) {
    frame(holding({Action::Fluoroscopy}));
    EXPECT_TRUE(exercise.simulation().console().beam_on());
    EXPECT_EQ(exercise.simulation().console().mode(), script::ImagingMode::Live);
    frame(Input());
    EXPECT_FALSE(exercise.simulation().console().beam_on());
    const auto acquire = commands(holding({Action::Acquisition}));
    EXPECT_EQ(find<script::SetMode>(acquire)->mode, script::ImagingMode::Dsa);
    EXPECT_TRUE(find<script::NewMask>(acquire));
    last = exercise.next_frame(acquire).motion;
    EXPECT_FALSE(find<script::NewMask>(commands(holding({Action::Acquisition}))));
    frame(Input());
    Input roadmap = holding({Action::Fluoroscopy});
    roadmap.pressed = {Action::Roadmap};
    frame(roadmap);
    EXPECT_EQ(exercise.simulation().console().mode(), script::ImagingMode::Roadmap);
}

TEST_F(HandsTest, KeysShiftTheMaskAndHoldTheBreath) {
    using Way = script::ShiftMask::Way;
    const auto once = commands(pressing({Action::ShiftRight, Action::ShiftRight, Action::ShiftUp}));
    ASSERT_EQ(once.size(), 1u);
    EXPECT_EQ(find<script::ShiftMask>(once)->way, Way::By);
    EXPECT_EQ(find<script::ShiftMask>(once)->x, 2 * map.speeds.shift[1]);
    EXPECT_EQ(find<script::ShiftMask>(once)->y, -map.speeds.shift[1]);
    Input fine = pressing({Action::ShiftDown});
    fine.held.set(static_cast<std::size_t>(Action::Fine));
    EXPECT_EQ(find<script::ShiftMask>(commands(fine))->y, map.speeds.shift[0]);
    EXPECT_TRUE(commands(pressing({Action::ShiftLeft, Action::ShiftRight})).empty());
    const auto three = commands(pressing({Action::ShiftLeft, Action::ShiftAuto, Action::ShiftOff}));
    ASSERT_EQ(three.size(), 3u);
    EXPECT_EQ(script::to_text(three[1]), "shift auto");
    EXPECT_EQ(script::to_text(three[2]), "shift off");
    frame(pressing({Action::Breath}));
    EXPECT_EQ(exercise.simulation().breathing().state(), scenario::Breathing::State::Held);
    frame(pressing({Action::Breath}));
    EXPECT_EQ(exercise.simulation().breathing().state(), scenario::Breathing::State::Free);
}

TEST_F(HandsTest, KeysMoveTheHandToTheValveAndAwayAsFarAsTheCommandGoes) {
    using script::Held;
    const auto twice = commands(pressing({Action::GripCloser, Action::GripCloser}));
    ASSERT_EQ(twice.size(), 1u);
    EXPECT_EQ(script::to_text(twice[0]), "grip wire 80 mm");
    EXPECT_TRUE(commands(pressing({Action::GripCloser, Action::GripFarther})).empty());
    frame(pressing({Action::GripCloser, Action::GripCloser}));
    EXPECT_EQ(exercise.simulation().gripped_at(Held::Wire), 80);
    EXPECT_FALSE(exercise.simulation().gripped_at(Held::Catheter));
    EXPECT_EQ(script::to_text(commands(pressing({Action::GripFarther})).at(0)), "grip wire 90 mm");
    for (int k = 0; k < 10; ++k) frame(pressing({Action::GripCloser}));
    EXPECT_EQ(exercise.simulation().gripped_at(Held::Wire), script::least_grip);
    EXPECT_EQ(messages.back(), "The hand on the wire goes no closer than 5 mm from the valve");
    for (int k = 0; k < 60; ++k) frame(pressing({Action::GripFarther}));
    EXPECT_EQ(exercise.simulation().gripped_at(Held::Wire), script::largest_grip);
    EXPECT_EQ(messages.back(), "The hand on the wire goes no farther than 500 mm from the valve");
}

TEST(HandsGrip, AHandThatHoldsAllTakesEachDeviceCloserAndThePapersRelaxersNone) {
    const KeyMap map = load_keys(test::asset("keys.toml"));
    std::vector<std::string> messages;
    const auto pressed = [&](exercise::Exercise& exercise, std::initializer_list<Action> keys) {
        Hands hands(map, 1 / exercise.simulation().scenario().frame_rate);
        Input input;
        input.pressed = keys;
        return hands.commands(input, exercise.simulation(), {}, messages);
    };
    const std::string both = std::string(test::small_toml) + "[catheter]\ndevice = \"berenstein5f\"\n";
    exercise::Exercise two(test::small_scenario(both), true);
    const auto one = pressed(two, {Action::Device, Action::GripCloser});
    ASSERT_EQ(one.size(), 1u);
    EXPECT_EQ(script::to_text(one[0]), "grip catheter 90 mm");
    const auto all = pressed(two, {Action::Device, Action::Device, Action::GripCloser});
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(script::to_text(all[0]), "grip wire 90 mm");
    EXPECT_EQ(script::to_text(all[1]), "grip catheter 90 mm");
    scenario::Scenario paper = test::small_scenario();
    paper.relaxer.kind = physics::RelaxerKind::Segment;
    exercise::Exercise of_paper(paper, true);
    EXPECT_TRUE(pressed(of_paper, {Action::GripCloser}).empty());
    test::expect_said(messages.back(), "global");
}

TEST_F(HandsTest, TheStandGoesNoFurtherThanItCanAndSaysSo) {
    for (int k = 0; k < 400; ++k) frame(holding({Action::ArmLao, Action::ArmCranial, Action::TableHead}));
    const render::CArm arm = exercise.simulation().console().arm();
    EXPECT_TRUE(render::problems(arm).empty());
    EXPECT_GT(arm.cranial, 0.7);
    EXPECT_FALSE(messages.empty());
    EXPECT_LE(exercise.simulation().console().table().z(), script::table_reach.z());
    const double field = exercise.simulation().console().arm().detector_width;
    frame(pressing({Action::Magnify}));
    EXPECT_LT(exercise.simulation().console().arm().detector_width, field);
    frame(pressing({Action::Widen}));
    frame(pressing({Action::Collimate, Action::Collimate}));
    EXPECT_LT(exercise.simulation().console().arm().opening_width, 0.9 * field);
    frame(pressing({Action::PulsesFewer}));
    EXPECT_EQ(exercise.simulation().console().pulse_rate(), 7.5);
}

/// A wire alone: there is a sheath, and a tube without an aorta.
TEST_F(HandsTest, OneInjectionAtATimeGoesThroughTheIntroducerAndNeverThroughAWire) {
    Input input;
    input.injections = {0, 1};
    const auto made = commands(input);
    ASSERT_EQ(made.size(), 1u);
    EXPECT_EQ(script::to_text(made[0]), "inject 5 ml at 2 ml/s through introducer of 320 mg/ml");
    EXPECT_EQ(messages.back(), "Hand: 5 ml at 2 ml/s through the introducer");
    last = exercise.next_frame(made).motion;
    input.injections = {2};
    EXPECT_TRUE(commands(input).empty());
    EXPECT_EQ(messages.back(), "One injection at a time: this one takes 2.4 s more");
    for (int k = 0; exercise.simulation().contrast().injecting(); ++k) {
        ASSERT_LT(k, 60);
        frame(input);
        EXPECT_LE(exercise.simulation().contrast().injection_rate(), 2);
    }
    const auto pump = commands(input);
    EXPECT_EQ(script::to_text(pump.at(0)), "inject 20 ml at 20 ml/s through introducer of 320 mg/ml");
    // 30 ml each, until the patient bears no more.
    input.injections = {3};
    for (int k = 0; k < 1000; ++k) frame(input);
    test::expect_said(messages.back(), "beyond the patient's limit of contrast");
    EXPECT_GE(exercise.simulation().contrast().left(), 0);
    EXPECT_LT(exercise.simulation().contrast().left(), 30);
}

TEST_F(HandsTest, AHandWaitsForAWireThatIsBehind) {
    last.waiting_insertion = 10;
    EXPECT_FALSE(find<script::Advance>(commands(holding({Action::Advance}))));
    EXPECT_TRUE(find<script::Rotate>(commands(holding({Action::RotateRight}))));
}

TEST_F(HandsTest, AFlushCatheterFromAnotherAccessLiesWhereTheVesselsHaveTheBranch) {
    const KeyMap mine = parse_keys(
        "[[injection]]\nkey = \"F1\"\nvolume_ml = 20\nrate_ml_per_s = 20\ninto = \"tube\"\n"
        "[[injection]]\nkey = \"F2\"\nvolume_ml = 20\nrate_ml_per_s = 30\ninto = \"tube\"\n"
        "[[injection]]\nkey = \"F3\"\ninto = \"introducer\"\n",
        "mine", map);
    Hands own(mine, 1 / exercise.simulation().scenario().frame_rate);
    const auto press = [&](int index) {
        Input input;
        input.injections = {index};
        return own.commands(input, exercise.simulation(), last, messages);
    };
    EXPECT_TRUE(press(1).empty());
    EXPECT_EQ(messages.back(),
              "A 5 F flush catheter passes 23 ml/s at the pump's 1200 psi; 30 ml/s were asked for");
    EXPECT_EQ(script::to_text(press(2).at(0)), "inject 5 ml at 2 ml/s through introducer of 320 mg/ml");
    EXPECT_EQ(script::to_text(press(0).at(0)), "inject 20 ml at 20 ml/s into tube of 320 mg/ml");
    EXPECT_EQ(messages.back(),
              "Pump: 20 ml at 20 ml/s through a flush catheter in the tube, from another access");
}

/// A wire in a catheter, with friction in each other and in valves: what nobody holds is dragged along.
std::string two_devices() {
    return test::small_toml_with("frictionless = true", "friction = 0\nvalve_friction_N = 0.002") +
           "[catheter]\ndevice = \"cobra5f\"\ninserted_mm = 15\nfriction = 0\ninner_friction = 0.5\n"
           "valve_friction_N = 0.1\n";
}

class TwoHands : public HandsTest {
protected:
    TwoHands() : HandsTest(two_devices()) {}
    double inside(script::Held device) const { return exercise.simulation().inserted(device); }
    void settle() {
        for (int k = 0; k < 40; ++k) frame(Input());
    }
};

TEST_F(TwoHands, BothActInOneFrameEachOnItsDevice) {
    using script::Held;
    Input both =
        holding({Action::Advance, Action::LeftWithdraw, Action::RotateRight, Action::LeftRotateLeft});
    const auto made = commands(both);
    ASSERT_EQ(made.size(), 4u);
    EXPECT_EQ(std::get<script::Advance>(made[0]).held, Held::Wire);
    EXPECT_EQ(std::get<script::Rotate>(made[1]).held, Held::Wire);
    EXPECT_GT(std::get<script::Rotate>(made[1]).angle, 0);
    EXPECT_EQ(std::get<script::Withdraw>(made[2]).held, Held::Catheter);
    EXPECT_EQ(std::get<script::Rotate>(made[3]).held, Held::Catheter);
    EXPECT_LT(std::get<script::Rotate>(made[3]).angle, 0);
    // Sticks: each hand's own.
    Input sticks;
    sticks.push = {1, -1};
    const auto by_sticks = commands(sticks);
    ASSERT_EQ(by_sticks.size(), 2u);
    EXPECT_EQ(std::get<script::Advance>(by_sticks[0]).held, Held::Wire);
    EXPECT_EQ(std::get<script::Withdraw>(by_sticks[1]).held, Held::Catheter);
    // The mouse is the hand that the key file says.
    Input mouse;
    mouse.wheel = 1;
    EXPECT_EQ(std::get<script::Advance>(commands(mouse).at(0)).held, Held::Wire);
    KeyMap other = parse_keys("[hand]\nmouse = \"left\"\n", "mine", map);
    Hands left(other, 1 / exercise.simulation().scenario().frame_rate);
    EXPECT_EQ(
        std::get<script::Advance>(left.commands(mouse, exercise.simulation(), last, messages).at(0)).held,
        Held::Catheter);
}

TEST_F(TwoHands, CounterMotionMovesBothAndReplaysToTheBit) {
    using script::Held;
    std::string recording;
    std::vector<std::uint64_t> states;
    const double wire = inside(Held::Wire), catheter = inside(Held::Catheter);
    for (int k = 0; k < 45; ++k) {
        Input both = holding({Action::Advance, Action::LeftWithdraw});
        if (k > 20) both.held.set(static_cast<std::size_t>(Action::LeftRotateRight));
        if (k == 30) both.pressed = {Action::Device};
        const auto made = commands(both);
        for (const script::Command& command : made)
            recording += fmt::format("{} {}\n", k, script::to_text(command));
        last = exercise.next_frame(made).motion;
        states.push_back(exercise.simulation().state_hash());
        if (k != 29) continue;
        EXPECT_GT(inside(Held::Wire), wire + 10);
        EXPECT_LT(inside(Held::Catheter), catheter - 8);
    }
    const script::CommandScript script = script::parse_commands(recording, "hands");
    int frames_of_both = 0;
    exercise::Exercise again(test::small_scenario(two_devices()), true);
    for (int k = 0; k < static_cast<int>(states.size()); ++k) {
        std::vector<script::Command> of_frame;
        int pushed = 0, pulled = 0;
        for (const script::TimedCommand& timed : script.at(k)) {
            of_frame.push_back(timed.command);
            pushed += std::holds_alternative<script::Advance>(timed.command);
            pulled += std::holds_alternative<script::Withdraw>(timed.command);
        }
        frames_of_both += pushed == 1 && pulled == 1;
        again.next_frame(of_frame);
        ASSERT_EQ(again.simulation().state_hash(), states[static_cast<std::size_t>(k)]) << "frame " << k;
    }
    EXPECT_GT(frames_of_both, 35);
}

TEST_F(TwoHands, ADeviceThatAHandOrTheHelperHoldsStaysAndWhatNobodyHoldsIsDragged) {
    using script::Held;
    Input push = holding({Action::LeftAdvance});
    const auto dragged_by = [&](int frames) {
        const double before = inside(Held::Wire), catheter = inside(Held::Catheter);
        for (int k = 0; k < frames; ++k) frame(push);
        settle();
        EXPECT_GT(inside(Held::Catheter), catheter + 1);
        return inside(Held::Wire) - before;
    };
    EXPECT_EQ(dragged_by(8), 0) << "the right hand has it";
    frame(pressing({Action::Helper}));
    EXPECT_EQ(messages.back(), "Right hand: nothing, left hand: catheter, helper: wire");
    EXPECT_EQ(dragged_by(8), 0) << "the helper has it";
    frame(pressing({Action::Helper}));
    EXPECT_EQ(messages.back(), "Right hand: nothing, left hand: catheter, helper: nothing");
    EXPECT_FALSE(exercise.simulation().devices()[0].pinned);
    EXPECT_GT(dragged_by(10), 1);
    frame(holding({Action::Advance}));
    EXPECT_EQ(messages.back(), "The right hand is empty: Tab takes a device");
    frame(pressing({Action::Helper}));
    EXPECT_TRUE(exercise.simulation().devices()[0].pinned);
    EXPECT_EQ(dragged_by(8), 0);
    // A new attempt begins as the first did.
    frame(pressing({Action::BackToStart}));
    EXPECT_TRUE(find<script::Advance>(commands(holding({Action::Advance}))));
}

TEST_F(TwoHands, HandsTakeDevicesFromEachOther) {
    using script::Held;
    const auto holds = [&](std::initializer_list<Action> pressed, std::optional<Held> right,
                           std::optional<Held> left) {
        commands(pressing(pressed));
        EXPECT_EQ(hands.grasp()->in(Side::Right), right);
        EXPECT_EQ(hands.grasp()->in(Side::Left), left);
    };
    holds({}, Held::Wire, Held::Catheter);
    holds({Action::Device}, Held::Catheter, Held::Wire);
    holds({Action::Device}, Held::All, {});
    holds({Action::LeftDevice}, {}, Held::Wire);
    holds({Action::Device}, Held::Catheter, Held::Wire);
    holds({Action::LeftDevice}, Held::Wire, Held::Catheter);
    holds({Action::LeftDevice}, {}, Held::All);
    commands(pressing({Action::Helper}));
    test::expect_said(messages.back(), "The left hand holds all");
    holds({Action::LeftDevice}, {}, {});
    holds({Action::LeftDevice, Action::Device}, Held::Catheter, Held::Wire);
}

TEST_F(HandsTest, OneDeviceIsTheRightHandsAndNobodyElseIsNeeded) {
    for (const Action action : {Action::Device, Action::LeftDevice, Action::Helper}) {
        EXPECT_TRUE(commands(pressing({action})).empty());
        test::expect_said(messages.back(), "This exercise has one device");
    }
    EXPECT_TRUE(commands(holding({Action::LeftAdvance})).empty());
    EXPECT_EQ(messages.back(), "The left hand is empty: this exercise has one device");
    EXPECT_TRUE(find<script::Advance>(commands(holding({Action::Advance}))));
}

TEST_F(TwoHands, ASyringeGivesWhatTheLumenPassesAndAPumpIsRefusedBeyondIt) {
    KeyMap mine = parse_keys(
        "[[injection]]\nkey = \"F1\"\nby = \"hand\"\nvolume_ml = 5\nrate_ml_per_s = 5\ninto = \"device\"\n"
        "[[injection]]\nkey = \"F2\"\nby = \"pump\"\nvolume_ml = 5\nrate_ml_per_s = 20\ninto = \"device\"\n",
        "mine", map);
    Hands own(mine, 1 / exercise.simulation().scenario().frame_rate);
    const auto press = [&](int index) {
        Input input;
        input.injections = {index};
        return own.commands(input, exercise.simulation(), last, messages);
    };
    const double most = exercise.simulation().largest_flow(script::Held::Catheter);
    ASSERT_LT(most, 5);
    ASSERT_GT(most, 0.1);
    EXPECT_TRUE(press(1).empty());
    test::expect_said(messages.back(), "ml/s at the pump's 1200 psi; 20 ml/s were asked for");
    const auto made = press(0);
    const auto* inject = find<script::Inject>(made);
    ASSERT_TRUE(inject);
    EXPECT_EQ(inject->through, script::Held::Catheter);
    EXPECT_LE(inject->rate, most);
    EXPECT_GT(inject->rate, most - 0.02);
    test::expect_said(messages.back(), "through the catheter, all that its lumen passes around the wire");
    last = exercise.next_frame(made).motion;
    EXPECT_EQ(last.denied, "");
    EXPECT_TRUE(exercise.simulation().contrast().injecting());
}

/// Whatever is held, pressed, dragged or injected, the commands can be made, written and read back, one
/// injection runs at a time, and nothing is not a number.
void do_anything(exercise::Exercise& exercise, const KeyMap& map, unsigned inputs) {
    Hands hands(map, 1 / exercise.simulation().scenario().frame_rate);
    StepReport last;
    std::vector<std::string> messages;
    for (unsigned seed = 0; seed < inputs; ++seed) {
        std::mt19937 random(seed);
        const auto unit = [&] { return 2 * std::ldexp(static_cast<double>(random()), -32) - 1; };
        Input input;
        for (int k = 0; k < room::actions; ++k)
            if (random() % 6 == 0) {
                input.held.set(static_cast<std::size_t>(k));
                if (random() % 2 && static_cast<Action>(k) != Action::BackToStart)
                    input.pressed.push_back(static_cast<Action>(k));
            }
        while (random() % 3 == 0)
            input.injections.push_back(static_cast<int>(random() % map.injections.size()));
        if (random() % 50 == 0) input.pressed.push_back(Action::BackToStart);
        const double wild = random() % 10 == 0 ? 1e6 : 10;
        input.wheel = wild * unit();
        input.drag_up = wild * unit();
        input.drag_right = wild * unit();
        input.arm_lao = unit();
        input.table_head = wild * unit();
        input.push = {2 * unit(), 2 * unit()};
        input.turn = {2 * unit(), 2 * unit()};
        if (wild > 10) input.wheel = 0;  // a thousand metres of wire take their time
        if (wild > 10) input.drag_up = 0;
        const auto made = hands.commands(input, exercise.simulation(), last, messages);
        std::string text;
        int injections = exercise.simulation().contrast().injecting();
        for (const script::Command& command : made) {
            text += "0 " + script::to_text(command) + "\n";
            injections += std::holds_alternative<script::Inject>(command);
        }
        const bool again = find<script::Reset>(made);
        ASSERT_LE(again ? 0 : injections, 1) << "seed " << seed;
        const auto read = script::parse_commands(text, "hands");
        ASSERT_EQ(read.commands.size(), made.size()) << "seed " << seed;
        for (std::size_t k = 0; k < made.size(); ++k)
            ASSERT_EQ(script::to_text(read.commands[k].command), script::to_text(made[k])) << "seed " << seed;
        ASSERT_NO_THROW(last = exercise.next_frame(made).motion) << "seed " << seed << "\n" << text;
        ASSERT_EQ(last.denied, "") << "seed " << seed << "\n" << text;
        ASSERT_TRUE(exercise.simulation().tip().allFinite()) << "seed " << seed;
        ASSERT_TRUE(std::isfinite(exercise.simulation().contrast().injected())) << "seed " << seed;
        messages.clear();
    }
}

TEST_F(HandsTest, WhateverHandsDoCanBeRecordedAndMade) {
    do_anything(exercise, map, 1000);
}
TEST_F(TwoHands, WhateverTheyDoCanBeRecordedAndMade) {
    do_anything(exercise, map, 1000);
}

}  // namespace
}  // namespace room
