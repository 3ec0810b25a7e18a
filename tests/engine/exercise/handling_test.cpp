#include "engine/exercise/handling.h"

#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/room_readout.h"
#include "physics/wire/energy.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/exercise/treated.h"

namespace exercise {
namespace {

/// The marks of a script in a scenario.
std::vector<HandlingErrorMark> marks_of(const scenario::Scenario& scenario, const std::string& script,
                                        const HandlingErrorLimits& limits = {}) {
    Exercise exercise(scenario, false);
    Handling handling(exercise.simulation(), limits);
    test::play(exercise, script, [&](const Frame& frame, const auto&) { handling.observe(frame); });
    return handling.marks();
}

/// Those of one kind.
std::vector<HandlingErrorMark> marks_of(HandlingError kind, const scenario::Scenario& scenario,
                                        const std::string& script, const HandlingErrorLimits& limits = {}) {
    std::vector<HandlingErrorMark> marks = marks_of(scenario, script, limits);
    std::erase_if(marks, [kind](const HandlingErrorMark& mark) { return mark.kind != kind; });
    return marks;
}

/// A press as the score and the room have it.
struct Press {
    double largest = 0;  // [N]
    int errors = 0, alarms = 0;
};

Press press_of(const scenario::Scenario& scenario, const std::string& script) {
    Exercise exercise(scenario, false);
    Handling handling(exercise.simulation());
    RoomReadout readout;
    Press press;
    test::play(exercise, script, [&](const Frame& frame, const auto&) {
        handling.observe(frame);
        readout.observe(frame, {});
        press.largest = std::max(press.largest, physics::largest_force(frame.simulation.contacts()));
        press.alarms = std::max(
            press.alarms, static_cast<int>(std::ranges::count(
                              readout.messages(), "The wire presses the wall hard", &render::Message::text)));
    });
    press.errors = static_cast<int>(
        std::ranges::count(handling.marks(), HandlingError::HardPress, &HandlingErrorMark::kind));
    return press;
}

}  // namespace

TEST(HandlingErrors, MotionWithoutBeamIsOneErrorUntilItPausesForHalfASecond) {
    const auto marks =
        marks_of(test::small_scenario(),
                 "2..4 advance 1 mm\n8 advance 1 mm\n30 rotate 5 deg\n40 beam on\n41 advance 1 mm\n");
    ASSERT_EQ(marks.size(), 2u);
    EXPECT_EQ(marks[0].kind, HandlingError::BlindMotion);
    EXPECT_EQ(marks[0].first, 2);
    EXPECT_EQ(marks[0].last, 8);
    EXPECT_NEAR(marks[0].start, 2 / 15.0, 1e-12);
    EXPECT_NEAR(marks[0].amount, 7 / 15.0, 1e-12);
    EXPECT_FALSE(marks[0].branch.empty());
    EXPECT_NEAR(marks[0].place.x(), 21, 1.5);  // the tip, 20 mm and one more along
    EXPECT_EQ(marks[1].first, 30);
}

TEST(HandlingErrors, BeamOnNothingCountsFromItsBeginning) {
    const auto marks = marks_of(test::small_scenario(), "0 beam on\n1 advance 1 mm\n80 end\n");
    ASSERT_EQ(marks.size(), 1u);
    EXPECT_EQ(marks[0].kind, HandlingError::IdleBeam);
    EXPECT_EQ(marks[0].first, 2);
    EXPECT_EQ(marks[0].last, 80);
    EXPECT_NEAR(marks[0].amount, 79 / 15.0, 1e-12);
    // Three seconds are not too long, and neither motion, nor contrast, nor the arm is idle.
    EXPECT_TRUE(marks_of(test::small_scenario(), "0 beam on\n1 advance 1 mm\n46 end\n").empty());
    EXPECT_TRUE(marks_of(test::small_scenario(),
                         "0 beam on\n30 arm lao 5 deg\n60 inject 12 ml at 4 ml/s into tube\n145 end\n")
                    .empty());
}

TEST(HandlingErrors, PushingOnAtAnOpenEndIsAgainstAStop) {
    const auto marks =
        marks_of(HandlingError::AgainstStop, test::small_scenario(), "0 beam on\n1..60 advance 2 mm\n");
    ASSERT_EQ(marks.size(), 1u);
    EXPECT_GT(marks[0].first, 20);
    EXPECT_GE(marks[0].last, 34);  // then it gives way, and folds back in the tube
}

TEST(HandlingErrors, FeedingOnWhileTheTipStaysIsAgainstAStop) {
    const scenario::Scenario blind = scenario::parse_scenario(R"(schema = 1
title = "blind"
[[anatomy.branch]]
name = "v"
closed = true
points_mm = [[0, 0, 0, 3], [0, 0, 80, 3]]
[entry]
end = "v.in"
inserted_mm = 70.0
[guidewire]
device = "bentson035"
frictionless = true
[chain]
torsion = "rigid"
[tissue]
rigid = true
[target]
centre_mm = [0, 0, 60]
)",
                                                              "blind.toml", test::asset("devices"));
    const auto marks = marks_of(HandlingError::AgainstStop, blind, "0 beam on\n1..20 advance 2 mm\n");
    ASSERT_EQ(marks.size(), 1u);
    EXPECT_GE(marks[0].amount, HandlingErrorLimits().stuck_feed);
    EXPECT_LE(marks[0].amount, 40);
    // A tip that goes on is not stuck.
    EXPECT_TRUE(marks_of(HandlingError::AgainstStop, blind, "0 beam on\n1..3 advance 2 mm\n").empty());
    EXPECT_TRUE(
        marks_of(HandlingError::AgainstStop, test::small_scenario(), "0 beam on\n1..15 advance 2 mm\n")
            .empty());
}

TEST(HandlingErrors, ForceCountsAboveTheLimitWithItsLargest) {
    HandlingErrorLimits limits;
    limits.force = 0.015;
    Exercise exercise(test::small_scenario(), false);
    Handling handling(exercise.simulation(), limits);
    double largest = 0;
    bool over = false;
    for (int index = 0; index < 20; ++index) {
        const std::vector<script::Command> push = {script::Advance{2}};
        handling.observe(exercise.next_frame(push));
        const double force = physics::largest_force(exercise.simulation().contacts());
        over = over || force > limits.force;
        largest = std::max(largest, force);
    }
    ASSERT_TRUE(over);
    double marked = 0;
    for (const HandlingErrorMark& mark : handling.marks())
        if (mark.kind == HandlingError::HardPress) marked = std::max(marked, mark.amount);
    EXPECT_DOUBLE_EQ(marked, largest);
}

TEST(HandlingErrors, AHardPressIsAnErrorAndAnAlarmButNotThatOfAnInflatedBalloon) {
    const double limit = HandlingErrorLimits().force;
    // A rod through a bend.
    scenario::Scenario rod = test::small_scenario();
    scenario::TipAndShaft stiffness = scenario::tip_and_shaft(rod.devices[0].device).value();
    stiffness.shaft_rigidity = stiffness.tip_rigidity = 8000;
    scenario::set_stiffness(rod.devices[0].device, stiffness);
    const Press pushed = press_of(rod, "1..25 advance 2 mm\n40 end\n");
    EXPECT_GT(pushed.largest, limit);
    EXPECT_GE(pushed.errors, 1);
    EXPECT_EQ(pushed.alarms, 1);
    // In a bend that it straightens, inflated and while it is deflated.
    scenario::Device stiff = test::balloon_catheter();
    stiff.balloon->rigidity = 5000;
    const Press inflated =
        press_of(test::scenario_to_treat(stiff, "", 50), "1 inflate 12 atm\n120 deflate\n240 end\n");
    EXPECT_GT(inflated.largest, limit);
    EXPECT_EQ(inflated.errors, 0);
    EXPECT_EQ(inflated.alarms, 0);
}

TEST(HandlingErrors, ATipOutsideTheFieldIsOne) {
    const std::string away = "0 beam on\n0 table 0 0 300 mm\n2 advance 1 mm\n";
    const auto marks = marks_of(HandlingError::OutOfView, test::small_scenario(), away);
    ASSERT_EQ(marks.size(), 1u);
    EXPECT_EQ(marks[0].first, 2);
    EXPECT_TRUE(
        marks_of(HandlingError::OutOfView, test::small_scenario(), "0 beam on\n2 advance 1 mm\n").empty());
    // Behind the collimator is outside, too.
    const auto collimated = marks_of(HandlingError::OutOfView, test::small_scenario(),
                                     "0 beam on\n0 collimate 10 10 mm\n2 advance 1 mm\n");
    EXPECT_EQ(collimated.size(), 1u);
}

TEST(HandlingErrors, ATargetThatWasReachedAndLeftIsLost) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.target.name = "";
    scenario.target.centre = geometry::Vec3(22, 0, 0);
    const auto lost =
        marks_of(HandlingError::TargetLost, scenario, "0 beam on\n1 advance 1 mm\n20..27 advance 2 mm\n");
    ASSERT_EQ(lost.size(), 1u);
    EXPECT_GT(lost[0].amount, 2 * scenario.target.radius);
    EXPECT_TRUE(marks_of(HandlingError::TargetLost, scenario, "0 beam on\n1 advance 1 mm\n20 advance 2 mm\n")
                    .empty());
}

TEST(HandlingErrors, ARoadmapHoldsForItsViewOnly) {
    const std::string map = "0 beam on\n0 mode dsa\n5 mode roadmap\n";
    const auto stale = [](const std::string& script) {
        return marks_of(HandlingError::StaleRoadmap, test::small_scenario(), script);
    };
    EXPECT_TRUE(stale(map + "6 advance 1 mm\n").empty());
    EXPECT_EQ(stale(map + "6 arm lao 10 deg\n7 advance 1 mm\n").size(), 1u);
    EXPECT_EQ(stale(map + "6 table 0 0 5 mm\n7 advance 1 mm\n").size(), 1u);
    EXPECT_EQ(stale("0 beam on\n0 mode roadmap\n7 advance 1 mm\n").size(), 1u);  // without a map at all
    EXPECT_TRUE(stale(map + "6 arm lao 10 deg\n7 mode live\n8 advance 1 mm\n").empty());
}

TEST(HandlingErrors, ContrastAgainstTheWallTheCatheterPointsAt) {
    const auto scenario = [](const std::string& device) {
        return test::small_scenario_with(
            "[relaxer]", "[catheter]\ndevice = \"" + device + "\"\ninserted_mm = 40.0\n[relaxer]");
    };
    const std::string script = "0 beam on\n5 inject 0.3 ml at 0.3 ml/s through catheter\n30 end\n";
    HandlingErrorLimits limits;
    limits.tip_force = 1e-6;
    const auto bent = marks_of(HandlingError::InjectionAtWall, scenario("cobra5f"), script, limits);
    ASSERT_EQ(bent.size(), 1u);
    EXPECT_GE(bent[0].first, 5);
    EXPECT_LE(bent[0].last, 5 + 16);
    EXPECT_GT(bent[0].amount, limits.tip_force);
    // Not while nothing is injected, nor for an injection from elsewhere.
    EXPECT_TRUE(
        marks_of(HandlingError::InjectionAtWall, scenario("cobra5f"), "0 beam on\n30 end\n", limits).empty());
    EXPECT_TRUE(marks_of(HandlingError::InjectionAtWall, scenario("cobra5f"),
                         "0 beam on\n5 inject 1 ml at 1 ml/s into tube\n30 end\n", limits)
                    .empty());
}

TEST(HandlingErrors, AResetBeginsWithoutAny) {
    EXPECT_TRUE(marks_of(test::small_scenario(), "2 advance 1 mm\n5 reset\n6 end\n").empty());
}

/// Marks stand in order, lie in the run, and those of one kind are apart.
TEST(HandlingErrors, OfWildHandsAreInOrder) {
    for (unsigned seed = 1; seed <= 60; ++seed) {
        std::mt19937 random(seed);
        Exercise exercise(test::small_scenario(), false);
        Handling handling(exercise.simulation());
        std::array<int, handling_error_kinds> last;
        for (int index = 0; index < 120; ++index)
            handling.observe(exercise.next_frame(test::random_commands(random)));
        last.fill(-100);
        int before = 0, counted = 0;
        for (const HandlingErrorMark& mark : handling.marks()) {
            int& end = last[static_cast<std::size_t>(mark.kind)];
            EXPECT_GE(mark.first, 0) << "seed " << seed;
            EXPECT_LE(mark.first, mark.last) << "seed " << seed;
            EXPECT_LT(mark.last, 120) << "seed " << seed;
            EXPECT_GE(mark.last, before) << "seed " << seed;  // those of one frame may begin earlier
            EXPECT_GT(mark.first, end) << "seed " << seed;
            EXPECT_TRUE(std::isfinite(mark.amount) && mark.amount >= 0) << "seed " << seed;
            end = mark.last;
            before = mark.first;
        }
        for (const int count : counts(handling.marks())) counted += count;
        EXPECT_EQ(counted, static_cast<int>(handling.marks().size())) << "seed " << seed;
    }
}

}  // namespace exercise
