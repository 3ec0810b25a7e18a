/// A guided lesson: a step is done when its effect is there, not when its key was pressed.

#include "engine/room/guide.h"

#include <map>
#include <set>

#include "engine/room/results.h"
#include "tests/engine/room/hands_fixture.h"

namespace room {
namespace {

using script::practice;

scenario::LessonStep step(std::vector<Practice> practise) {
    return {std::move(practise), "do it"};
}
Effects effects(std::initializer_list<std::pair<Practice, double>> amounts) {
    Effects made{};
    for (const auto& [practised, amount] : amounts) made[practised] = amount;
    return made;
}

TEST(Guide, AStepIsDoneWhenEnoughCameOfAllThatItPractises) {
    Guide guide(
        {step({practice(Action::Advance), practice(Action::Withdraw)}), step({practice(Action::Breath)})});
    guide.count(effects({{practice(Action::Advance), 4}, {practice(Action::Breath), 1}}));
    EXPECT_FALSE(guide.is_done(0, 0));
    guide.count(effects({{practice(Action::Advance), 1.5}}));
    EXPECT_TRUE(guide.is_done(0, 0));
    EXPECT_EQ(guide.shown(), 0u);
    guide.count(effects({{practice(Action::Withdraw), 5}}));
    EXPECT_EQ(guide.shown(), 1u);  // what was done before it was shown does not count
    EXPECT_EQ(guide.done(), 1);
    guide.did(Action::Breath);
    EXPECT_TRUE(guide.over());
    EXPECT_TRUE(guide.passed());
}

TEST(Guide, AStepLeftOutIsNoneThatWasDoneUntilItIsDoneLater) {
    Guide guide({step({practice(Action::Pause)}), step({practice(Action::Help)})});
    guide.skip();
    EXPECT_TRUE(guide.is_skipped(0));
    EXPECT_EQ(guide.shown(), 1u);
    guide.did(Action::Help);
    EXPECT_TRUE(guide.over());
    EXPECT_FALSE(guide.passed());
    guide.skip();  // there is nothing to leave out
    guide.did(Action::Pause);
    EXPECT_EQ(guide.skipped(), 0);
    EXPECT_TRUE(guide.passed());
}

/// Actions that the first lesson does not practise, and why.
const std::map<Action, std::string> not_practised = {
    {Action::Finish, "it ends the lesson"},     {Action::Instructor, "it is the teacher's"},
    {Action::Skip, "it leaves out a step"},     {Action::Inflate, "it has no balloon"},
    {Action::Deploy, "it has no stent"},        {Action::Deflate, "it has no balloon"},
    {Action::NextBalloon, "it has no balloon"},
};

TEST(Guide, TheFirstLessonPractisesEveryActionOfTheRoom) {
    const scenario::Scenario lesson = test::shipped_scenario("first_steps");
    std::set<Practice> practised;
    for (const scenario::LessonStep& one : lesson.lesson.steps)
        for (const Practice p : one.practise)
            EXPECT_TRUE(practised.insert(p).second) << script::practice_names()[p] << " twice";
    for (Practice p = 0; p < practices; ++p) {
        const bool exempt = p < actions && not_practised.contains(static_cast<Action>(p));
        EXPECT_NE(practised.contains(p), exempt) << script::practice_names()[p];
    }
}

TEST(Guide, ReadingRefusesAnUnknownActionAndNamesThoseThereAre) {
    const auto said = [](const std::string& step) {
        return test::refusal(
            [&] { test::small_scenario(std::string(test::small_toml) + "[[lesson.step]]\n" + step); });
    };
    EXPECT_EQ(said("practise = [\"advance\"]\ntext = \"push\"\n"), "");
    const std::string wrong = said("practise = [\"advanze\"]\ntext = \"push\"\n");
    for (const char* words : {"'advanze'", "did you mean 'advance'?", "inject_by_pump", "reach_target"})
        EXPECT_NE(wrong.find(words), std::string::npos) << words << " in " << wrong;
    EXPECT_NE(said("practise = []\ntext = \"push\"\n").find("one or more"), std::string::npos);
    EXPECT_NE(said("text = \"push\"\n").find("practise"), std::string::npos);
    EXPECT_NE(said("practise = [\"advance\"]\n").find("text"), std::string::npos);
}

/// A wire in a catheter, and what frames by hand come to.
class Practised : public HandsTest {
protected:
    Practised()
        : HandsTest(std::string(test::small_toml) + "[catheter]\ndevice = \"cobra5f\"\ninserted_mm = 10\n") {
        frame(Input());
    }

    /// Frames of the same input, until `wanted` is enough or there are too many.
    bool come_of(const Input& input, Practice wanted, int most = 60) {
        double amount = 0;
        for (int k = 0; k < most && amount < enough(wanted); ++k) amount += effects_in(input)[wanted];
        return amount >= enough(wanted);
    }
    bool come_of_holding(std::initializer_list<Action> held, Action wanted) {
        return come_of(holding(held), practice(wanted));
    }
    bool come_of_pressing(Action pressed, std::initializer_list<Action> held = {}) {
        Input input = holding(held);
        input.pressed = {pressed};
        return come_of(input, practice(pressed), 1);
    }
    Effects effects_in(const Input& input) {
        const exercise::Simulation& simulation = exercise.simulation();
        const Situation before = situation_of(simulation, hands.grasp());
        const auto given = commands(input);
        const exercise::Frame made = exercise.next_frame(given);
        last = made.motion;
        return effects_of(before, situation_of(simulation, hands.grasp()), input, made, map,
                          exercise.score().completed);
    }
};

TEST_F(Practised, HandsAreWhatMovedTheDeviceInThem) {
    for (const Action action :
         {Action::Advance, Action::Withdraw, Action::RotateLeft, Action::RotateRight, Action::LeftAdvance,
          Action::LeftWithdraw, Action::LeftRotateLeft, Action::LeftRotateRight})
        EXPECT_TRUE(come_of_holding({action}, action)) << info(action).key;
    EXPECT_TRUE(come_of_holding({Action::Fine, Action::Advance}, Action::Fine));
    EXPECT_TRUE(come_of_holding({Action::Fast, Action::Withdraw}, Action::Fast));
    EXPECT_FALSE(come_of_holding({Action::Fast}, Action::Fast)) << "nothing moved";
    EXPECT_TRUE(come_of_pressing(Action::GripCloser));
    EXPECT_TRUE(come_of_pressing(Action::GripFarther));
    EXPECT_TRUE(come_of_pressing(Action::Helper));
    EXPECT_TRUE(come_of_pressing(Action::Device));
    EXPECT_TRUE(come_of_pressing(Action::LeftDevice));
}

TEST_F(Practised, TheStandIsWhereItWent) {
    for (const Action action :
         {Action::ArmLao, Action::ArmRao, Action::ArmCranial, Action::ArmCaudal, Action::TableHead,
          Action::TableFeet, Action::TableLeft, Action::TableRight, Action::TableUp, Action::TableDown})
        EXPECT_TRUE(come_of_holding({action}, action)) << info(action).key;
    for (const Action action :
         {Action::SidLess, Action::SidMore, Action::Magnify, Action::Widen, Action::Collimate,
          Action::Uncollimate, Action::WedgeIn, Action::WedgeTurn, Action::WedgeOut, Action::LungShutter,
          Action::LungShutter, Action::PulsesFewer, Action::PulsesMore, Action::Breath})
        EXPECT_TRUE(come_of_pressing(action)) << info(action).key;
    EXPECT_FALSE(come_of_pressing(Action::PulsesMore)) << "there are no more than frames";
    EXPECT_FALSE(come_of_pressing(Action::WedgeTurn)) << "no filter is in";
}

TEST_F(Practised, PicturesAreWhatTheBeamShowed) {
    EXPECT_FALSE(come_of_pressing(Action::ShiftLeft)) << "there is no mask";
    EXPECT_TRUE(come_of_holding({Action::Fluoroscopy}, Action::Fluoroscopy));
    EXPECT_TRUE(come_of_pressing(Action::Reference));
    Input contrast = holding({Action::Acquisition});
    EXPECT_TRUE(come_of_holding({Action::Acquisition}, Action::Acquisition));
    for (std::size_t k = 0; k < map.injections.size(); ++k)
        if (map.injections[k].by == InjectionPreset::By::Pump) {
            contrast.injections = {static_cast<int>(k)};
            break;
        }
    EXPECT_TRUE(come_of(contrast, script::inject_by_pump, 1));
    for (int k = 0; k < 20; ++k) effects_in(holding({Action::Acquisition}));
    for (const Action action :
         {Action::ShiftLeft, Action::ShiftRight, Action::ShiftUp, Action::ShiftDown, Action::ShiftOff})
        EXPECT_TRUE(come_of_pressing(action)) << info(action).key;
    effects_in(pressing({Action::Roadmap}));
    EXPECT_TRUE(come_of_holding({Action::Fluoroscopy}, Action::Roadmap));
    effects_in(pressing({Action::AcquisitionMode}));
    EXPECT_TRUE(come_of_holding({Action::Acquisition}, Action::AcquisitionMode)) << "cine";
    effects_in(pressing({Action::AcquisitionMode}));
    EXPECT_FALSE(come_of_holding({Action::Acquisition}, Action::AcquisitionMode)) << "DSA again";
    effects_in(Input());
    EXPECT_FALSE(come_of_pressing(Action::Mask, {Action::Acquisition})) << "the pedal took it";
    EXPECT_TRUE(come_of_pressing(Action::Mask, {Action::Acquisition}));
    for (int k = 0; k < 60; ++k) effects_in(Input());
    contrast.injections = {0};
    EXPECT_TRUE(come_of(contrast, script::inject_by_hand, 1));
    EXPECT_TRUE(come_of_pressing(Action::BackToStart));
}

TEST(Guide, WaysNameKeysMouseAndSticks) {
    const KeyMap map = load_keys(test::asset("keys.toml"));
    EXPECT_EQ(inputs_of(practice(Action::Advance), map),
              "Up; mouse: wheel, or drag up on the image; right stick up");
    EXPECT_EQ(inputs_of(practice(Action::LeftRotateLeft), map), "Q; left stick left");
    EXPECT_EQ(inputs_of(practice(Action::Fluoroscopy), map), "Space, GamepadA");
    EXPECT_EQ(inputs_of(script::inject_by_hand, map), "F1, F2");
}

TEST(Results, ALessonIsPassedByAllStepsAndTheTarget) {
    const test::TemporaryFolder folder;
    exercise::Score reached;
    reached.completed = true;
    {
        Results results(folder / "results.json");
        results.add_lesson("first", 3, 5, reached);
        EXPECT_EQ(results.find("first")->passed, 0);
        results.add_lesson("first", 5, 5, exercise::Score());
        EXPECT_EQ(results.find("first")->passed, 0);
        results.add_lesson("first", 5, 5, reached);
    }
    const Results kept(folder / "results.json");
    ASSERT_TRUE(kept.find("first"));
    EXPECT_EQ(kept.find("first")->attempts, 3);
    EXPECT_EQ(kept.find("first")->passed, 1);
    EXPECT_EQ(kept.find("first")->steps, 5);
}

TEST(Results, AttemptsAtOtherPatientsCountAndAreKeptApart) {
    const test::TemporaryFolder folder;
    exercise::Grade grade;
    grade.reached = true;
    {
        Results results(folder / "results.json");
        results.add("renal", grade, {});
        results.add("renal", grade, {}, "2");
        results.add("renal", {}, {}, "2");
    }
    const Results kept(folder / "results.json");
    ASSERT_TRUE(kept.find("renal"));
    EXPECT_EQ(kept.find("renal")->attempts, 3);
    ASSERT_EQ(kept.find("renal")->patients.size(), 1u);
    EXPECT_EQ(kept.find("renal")->patients.at("2").attempts, 2);
    EXPECT_EQ(kept.find("renal")->patients.at("2").reached, 1);
}

}  // namespace
}  // namespace room
