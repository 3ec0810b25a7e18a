/// Hands, pedals and stand: what is held and pressed becomes the commands of a frame.

#include "engine/room/hands.h"

#include <cmath>
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
    HandsTest()
        : exercise(test::small_scenario(), true),
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
    input.push = 1;
    EXPECT_NEAR(find<script::Advance>(commands(input))->length,
                10 / exercise.simulation().scenario().frame_rate, 1e-3);
    input.push = map.speeds.dead_zone / 2;
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

TEST_F(HandsTest, InjectionsGoWhereTheTipIsAndEndAtTheLimit) {
    Input input;
    input.injections = {0};
    const auto made = commands(input);
    const auto* inject = find<script::Inject>(made);
    ASSERT_TRUE(inject);
    EXPECT_EQ(inject->branch, "tube");
    input.injections.assign(100, 3);  // 30 ml each, more than a patient bears
    last = exercise.next_frame(commands(input)).motion;
    EXPECT_FALSE(messages.empty());
    EXPECT_GE(exercise.simulation().contrast().left(), 0);
}

TEST_F(HandsTest, AHandWaitsForAWireThatIsBehind) {
    last.waiting_insertion = 10;
    EXPECT_FALSE(find<script::Advance>(commands(holding({Action::Advance}))));
    EXPECT_TRUE(find<script::Rotate>(commands(holding({Action::RotateRight}))));
}

/// Whatever is held, pressed, dragged or injected, the commands can be made, written and read back.
TEST_F(HandsTest, WhateverHandsDoCanBeRecordedAndMade) {
    for (unsigned seed = 0; seed < 1000; ++seed) {
        std::mt19937 random(seed);
        const auto unit = [&] { return 2 * std::ldexp(static_cast<double>(random()), -32) - 1; };
        Input input;
        for (int k = 0; k < room::actions; ++k)
            if (random() % 6 == 0) {
                input.held.set(static_cast<std::size_t>(k));
                if (random() % 2 && static_cast<Action>(k) != Action::BackToStart)
                    input.pressed.push_back(static_cast<Action>(k));
            }
        if (random() % 4 == 0) input.injections.push_back(static_cast<int>(random() % map.injections.size()));
        if (random() % 50 == 0) input.pressed.push_back(Action::BackToStart);
        const double wild = random() % 10 == 0 ? 1e6 : 10;
        input.wheel = wild * unit();
        input.drag_up = wild * unit();
        input.drag_right = wild * unit();
        input.arm_lao = unit();
        input.table_head = wild * unit();
        input.push = 2 * unit();
        input.turn = 2 * unit();
        if (wild > 10) input.wheel = 0;  // a thousand metres of wire take their time
        if (wild > 10) input.drag_up = 0;
        const auto made = commands(input);
        std::string text;
        for (const script::Command& command : made) text += "0 " + script::to_text(command) + "\n";
        const auto read = script::parse_commands(text, "hands");
        ASSERT_EQ(read.commands.size(), made.size()) << "seed " << seed;
        for (std::size_t k = 0; k < made.size(); ++k)
            ASSERT_EQ(script::to_text(read.commands[k].command), script::to_text(made[k])) << "seed " << seed;
        ASSERT_NO_THROW(last = exercise.next_frame(made).motion) << "seed " << seed << "\n" << text;
    }
}

}  // namespace
}  // namespace room
