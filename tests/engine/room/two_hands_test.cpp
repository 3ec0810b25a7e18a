/// Two hands and a helper, and whatever they do.

#include <cmath>
#include <fmt/format.h>
#include <random>

#include "tests/cases.h"
#include "tests/engine/room/hands_fixture.h"

namespace room {
namespace {

/// A wire in a catheter, with friction in each other and in valves: what nobody holds is dragged along.
std::string two_devices() {
    return test::small_toml_with("frictionless = true", "friction = 0\nvalve_friction_N = 0.002") +
           "[catheter]\ndevice = \"cobra5f\"\ninserted_mm = 15\nfriction = 0\ninner_friction = 0.5\n"
           "valve_friction_N = 0.1\n";
}

class TwoHands : public HandsTest {
protected:
    TwoHands() : HandsTest(two_devices()) {}
    double inside(script::DeviceRole device) const { return exercise.simulation().inserted(device); }
    void settle() {
        for (int k = 0; k < 40; ++k) frame(Input());
    }
};

TEST_F(TwoHands, BothActInOneFrameEachOnItsDevice) {
    using script::DeviceRole;
    Input both =
        holding({Action::Advance, Action::LeftWithdraw, Action::RotateRight, Action::LeftRotateLeft});
    const auto made = commands(both);
    ASSERT_EQ(made.size(), 4u);
    EXPECT_EQ(std::get<script::Advance>(made[0]).held, DeviceRole::Wire);
    EXPECT_EQ(std::get<script::Rotate>(made[1]).held, DeviceRole::Wire);
    EXPECT_GT(std::get<script::Rotate>(made[1]).angle, 0);
    EXPECT_EQ(std::get<script::Withdraw>(made[2]).held, DeviceRole::Catheter);
    EXPECT_EQ(std::get<script::Rotate>(made[3]).held, DeviceRole::Catheter);
    EXPECT_LT(std::get<script::Rotate>(made[3]).angle, 0);
    // Sticks: each hand's own.
    Input sticks;
    sticks.push = {1, -1};
    const auto by_sticks = commands(sticks);
    ASSERT_EQ(by_sticks.size(), 2u);
    EXPECT_EQ(std::get<script::Advance>(by_sticks[0]).held, DeviceRole::Wire);
    EXPECT_EQ(std::get<script::Withdraw>(by_sticks[1]).held, DeviceRole::Catheter);
    // The mouse is the hand that the key file says.
    Input mouse;
    mouse.wheel = 1;
    EXPECT_EQ(std::get<script::Advance>(commands(mouse).at(0)).held, DeviceRole::Wire);
    KeyMap other = parse_keys("[hand]\nmouse = \"left\"\n", "mine", map);
    Hands left(other, 1 / exercise.simulation().scenario().frame_rate);
    EXPECT_EQ(
        std::get<script::Advance>(left.commands(mouse, exercise.simulation(), last, messages).at(0)).held,
        DeviceRole::Catheter);
}

TEST_F(TwoHands, CounterMotionMovesBothAndReplaysToTheBit) {
    using script::DeviceRole;
    std::string recording;
    std::vector<std::uint64_t> states;
    const double wire = inside(DeviceRole::Wire), catheter = inside(DeviceRole::Catheter);
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
        EXPECT_GT(inside(DeviceRole::Wire), wire + 10);
        EXPECT_LT(inside(DeviceRole::Catheter), catheter - 8);
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
    using script::DeviceRole;
    Input push = holding({Action::LeftAdvance});
    const auto dragged_by = [&](int frames) {
        const double before = inside(DeviceRole::Wire), catheter = inside(DeviceRole::Catheter);
        for (int k = 0; k < frames; ++k) frame(push);
        settle();
        EXPECT_GT(inside(DeviceRole::Catheter), catheter + 1);
        return inside(DeviceRole::Wire) - before;
    };
    EXPECT_EQ(dragged_by(8), 0) << "the right hand has it";
    frame(pressing({Action::Helper}));
    EXPECT_EQ(messages.back().text, "Right hand: nothing, left hand: catheter, helper: wire");
    EXPECT_EQ(dragged_by(8), 0) << "the helper has it";
    frame(pressing({Action::Helper}));
    EXPECT_EQ(messages.back().text, "Right hand: nothing, left hand: catheter, helper: nothing");
    EXPECT_FALSE(exercise.simulation().devices()[0].pinned);
    EXPECT_GT(dragged_by(10), 1);
    frame(holding({Action::Advance}));
    EXPECT_EQ(messages.back().text, "The right hand is empty: Tab takes a device");
    frame(pressing({Action::Helper}));
    EXPECT_TRUE(exercise.simulation().devices()[0].pinned);
    EXPECT_EQ(dragged_by(8), 0);
    // A new attempt begins as the first did.
    frame(pressing({Action::BackToStart}));
    EXPECT_TRUE(find<script::Advance>(commands(holding({Action::Advance}))));
}

TEST_F(TwoHands, HandsTakeDevicesFromEachOther) {
    using script::DeviceRole;
    const auto holds = [&](std::initializer_list<Action> pressed, std::optional<DeviceRole> right,
                           std::optional<DeviceRole> left) {
        commands(pressing(pressed));
        EXPECT_EQ(hands.grasp()->in(Side::Right), right);
        EXPECT_EQ(hands.grasp()->in(Side::Left), left);
    };
    holds({}, DeviceRole::Wire, DeviceRole::Catheter);
    holds({Action::Device}, DeviceRole::Catheter, DeviceRole::Wire);
    holds({Action::Device}, DeviceRole::All, {});
    holds({Action::LeftDevice}, {}, DeviceRole::Wire);
    holds({Action::Device}, DeviceRole::Catheter, DeviceRole::Wire);
    holds({Action::LeftDevice}, DeviceRole::Wire, DeviceRole::Catheter);
    holds({Action::LeftDevice}, {}, DeviceRole::All);
    commands(pressing({Action::Helper}));
    test::expect_said(messages.back().text, "The left hand holds all");
    holds({Action::LeftDevice}, {}, {});
    holds({Action::LeftDevice, Action::Device}, DeviceRole::Catheter, DeviceRole::Wire);
}

TEST_F(HandsTest, OneDeviceIsTheRightHandsAndNobodyElseIsNeeded) {
    for (const Action action : {Action::Device, Action::LeftDevice, Action::Helper}) {
        EXPECT_TRUE(commands(pressing({action})).empty());
        test::expect_said(messages.back().text, "This exercise has one device");
    }
    EXPECT_TRUE(commands(holding({Action::LeftAdvance})).empty());
    EXPECT_EQ(messages.back().text, "The left hand is empty: this exercise has one device");
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
    const double most = exercise.simulation().largest_flow(script::DeviceRole::Catheter);
    ASSERT_LT(most, 5);
    ASSERT_GT(most, 0.1);
    EXPECT_TRUE(press(1).empty());
    test::expect_said(messages.back().text, "ml/s at the pump's 1200 psi; 20 ml/s were asked for");
    const auto made = press(0);
    const auto* inject = find<script::Inject>(made);
    ASSERT_TRUE(inject);
    EXPECT_EQ(inject->through, script::DeviceRole::Catheter);
    EXPECT_LE(inject->rate, most);
    EXPECT_GT(inject->rate, most - 0.02);
    test::expect_said(messages.back().text,
                      "through the catheter, all that its lumen passes around the wire");
    last = exercise.next_frame(made).motion;
    EXPECT_EQ(last.denied, "");
    EXPECT_TRUE(exercise.simulation().contrast().injecting());
}

/// Whatever is held, pressed, dragged or injected, the commands can be made, written and read back, one
/// injection runs at a time, and nothing is not a number.
void do_anything(exercise::Exercise& exercise, const KeyMap& map, unsigned inputs) {
    Hands hands(map, 1 / exercise.simulation().scenario().frame_rate);
    StepReport last;
    Messages messages;
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
    do_anything(exercise, map, test::cases(1000));
}
TEST_F(TwoHands, WhateverTheyDoCanBeRecordedAndMade) {
    do_anything(exercise, map, test::cases(1000));
}

/// A microwire in a microcatheter in a guide, which the helper has at first.
TEST(ThreeDevices, HandsHelperAndWhateverTheyDo) {
    using script::DeviceRole;
    const KeyMap map = load_keys(test::asset("keys.toml"));
    exercise::Exercise exercise(
        test::small_scenario(test::replaced(test::small_toml_with("frictionless = true", "friction = 0.05"),
                                            "glide035", "standard014") +
                             "[microcatheter]\ndevice = \"micro17\"\ninserted_mm = 15\n"
                             "[catheter]\ndevice = \"guide6f\"\ninserted_mm = 10\n"),
        true);
    Hands hands(map, 1 / exercise.simulation().scenario().frame_rate);
    Messages messages;
    const auto press = [&](std::initializer_list<Action> pressed) {
        Input input;
        input.pressed = pressed;
        return hands.commands(input, exercise.simulation(), {}, messages);
    };
    press({});
    EXPECT_EQ(hands.grasp()->sentence(), "Right hand: wire, left hand: microcatheter, helper: catheter");
    press({Action::LeftDevice});
    EXPECT_EQ(hands.grasp()->sentence(), "Right hand: wire, left hand: catheter, helper: microcatheter");
    EXPECT_TRUE(press({Action::Helper}).empty());
    const auto let_go = press({Action::Helper});
    ASSERT_EQ(let_go.size(), 2u) << hands.grasp()->sentence();
    EXPECT_EQ(script::to_text(let_go[0]), "pin wire off");
    EXPECT_EQ(script::to_text(let_go[1]), "pin microcatheter off");
    do_anything(exercise, map, test::cases(1000));
}

}  // namespace
}  // namespace room
