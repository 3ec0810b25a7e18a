/// Hands, pedals and stand: what is held and pressed becomes the commands of a frame.

#include <cmath>
#include <numbers>

#include "tests/engine/room/hands_fixture.h"

namespace room {
namespace {

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
    using Way = script::ShiftMask::Mode;
    const auto once = commands(pressing({Action::ShiftRight, Action::ShiftRight, Action::ShiftUp}));
    ASSERT_EQ(once.size(), 1u);
    EXPECT_EQ(find<script::ShiftMask>(once)->mode, Way::By);
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
    using script::DeviceRole;
    const auto twice = commands(pressing({Action::GripCloser, Action::GripCloser}));
    ASSERT_EQ(twice.size(), 1u);
    EXPECT_EQ(script::to_text(twice[0]), "grip wire 80 mm");
    EXPECT_TRUE(commands(pressing({Action::GripCloser, Action::GripFarther})).empty());
    frame(pressing({Action::GripCloser, Action::GripCloser}));
    EXPECT_EQ(exercise.simulation().gripped_at(DeviceRole::Wire), 80);
    EXPECT_FALSE(exercise.simulation().gripped_at(DeviceRole::Catheter));
    EXPECT_EQ(script::to_text(commands(pressing({Action::GripFarther})).at(0)), "grip wire 90 mm");
    for (int k = 0; k < 10; ++k) frame(pressing({Action::GripCloser}));
    EXPECT_EQ(exercise.simulation().gripped_at(DeviceRole::Wire), script::least_grip);
    EXPECT_EQ(messages.back().text, "The hand on the wire goes no closer than 5 mm from the valve");
    for (int k = 0; k < 60; ++k) frame(pressing({Action::GripFarther}));
    EXPECT_EQ(exercise.simulation().gripped_at(DeviceRole::Wire), script::largest_grip);
    EXPECT_EQ(messages.back().text, "The hand on the wire goes no farther than 500 mm from the valve");
}

TEST(HandsGrip, AHandThatHoldsAllTakesEachDeviceCloserAndThePapersRelaxersNone) {
    const KeyMap map = load_keys(test::asset("keys.toml"));
    Messages messages;
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
    test::expect_said(messages.back().text, "global");
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
    EXPECT_EQ(messages.back().text, "Hand: 5 ml at 2 ml/s through the introducer");
    EXPECT_EQ(messages.back().notice, render::Notice::Info);
    last = exercise.next_frame(made).motion;
    input.injections = {2};
    EXPECT_TRUE(commands(input).empty());
    EXPECT_EQ(messages.back().text, "One injection at a time: this one takes 2.4 s more");
    EXPECT_EQ(messages.back().notice, render::Notice::Warning);
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
    test::expect_said(messages.back().text, "beyond the patient's limit of contrast");
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
    EXPECT_EQ(messages.back().text,
              "A 5 F flush catheter passes 23 ml/s at the pump's 1200 psi; 30 ml/s were asked for");
    EXPECT_EQ(script::to_text(press(2).at(0)), "inject 5 ml at 2 ml/s through introducer of 320 mg/ml");
    EXPECT_EQ(script::to_text(press(0).at(0)), "inject 20 ml at 20 ml/s into tube of 320 mg/ml");
    EXPECT_EQ(messages.back().text,
              "Pump: 20 ml at 20 ml/s through a flush catheter in the tube, from another access");
}

}  // namespace
}  // namespace room
