#include "engine/room/played_hand.h"

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <map>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/grade.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

constexpr double frame_rate = 15;

struct Sums {
    std::map<std::pair<bool, script::DeviceRole>, double> of;  // signed, by whether it turns and the device
    std::vector<std::string> others;                           // in order
    int frames = 0;
    void add(const script::Command& command) {
        if (const auto* advance = std::get_if<script::Advance>(&command))
            of[{false, advance->held}] += advance->length;
        else if (const auto* withdraw = std::get_if<script::Withdraw>(&command))
            of[{false, withdraw->held}] -= withdraw->length;
        else if (const auto* rotate = std::get_if<script::Rotate>(&command))
            of[{true, rotate->held}] += rotate->angle;
        else
            others.push_back(script::to_text(command));
    }
};

Sums all_of(const script::CommandScript& script) {
    Sums sums;
    for (const script::TimedCommand& timed : script.commands) sums.add(timed.command);
    return sums;
}

Sums played(PlayedHand hand, const Speeds& speeds) {
    Sums sums;
    for (; !hand.done() && sums.frames < 100000; ++sums.frames)
        for (const script::Command& command : hand.next({})) {
            sums.add(command);
            const auto* advance = std::get_if<script::Advance>(&command);
            if (advance) {
                EXPECT_GT(advance->length, 0);
                EXPECT_LE(advance->length, speeds.advance[2] / frame_rate * (1 + 1e-9));
            }
            if (const auto* rotate = std::get_if<script::Rotate>(&command)) {
                EXPECT_LE(std::abs(rotate->angle), speeds.rotate[2] / frame_rate * (1 + 1e-9));
            }
        }
    EXPECT_TRUE(hand.done());
    return sums;
}

script::CommandScript random_script(std::mt19937& random) {
    const auto pick = [&random](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const char* devices[] = {"", "catheter ", "all "};
    std::string text = "0 beam on\n";
    for (int frame = pick(10), line = pick(12); line >= 0; --line) {
        const int last = frame + pick(30);
        const char* device = devices[pick(3)];
        switch (pick(5)) {
            case 0:
                text += fmt::format("{}..{} advance {}{} mm\n", frame, last, device, 0.25 * (1 + pick(20)));
                break;
            case 1:
                text += fmt::format("{}..{} withdraw {}{} mm\n", frame, last, device, 0.25 * (1 + pick(20)));
                break;
            case 2:
                text += fmt::format("{}..{} rotate {}{} deg\n", frame, last, device, pick(41) - 20);
                break;
            case 3:
                text += fmt::format("{} mask\n", frame);
                break;
            case 4:
                text += fmt::format("{} inject 5 ml at 5 ml/s into aorta\n", frame);
                break;
        }
        frame = pick(3) == 0 ? frame : last + pick(20);
    }
    return script::parse_commands(text, "x.gw");
}

}  // namespace

TEST(PlayedHand, MakesTheScriptsMotionsAndAllElseInOrder) {
    Habits exact;
    exact.error = 0;
    for (unsigned seed = 1; seed <= 1000; ++seed) {
        std::mt19937 random(seed);
        const script::CommandScript script = random_script(random);
        const Sums wanted = all_of(script);
        const Sums made = played(PlayedHand(script, {}, frame_rate, exact, seed), {});
        for (const auto& [motion, sum] : wanted.of)
            EXPECT_NEAR(made.of.contains(motion) ? made.of.at(motion) : 0, sum, 1e-9 * (1 + std::abs(sum)))
                << "seed " << seed;
        EXPECT_EQ(made.of.size() <= wanted.of.size(), true);
        EXPECT_EQ(made.others, wanted.others) << "seed " << seed;
    }
}

TEST(PlayedHand, OvershootComesBackAndTakesLonger) {
    const script::CommandScript script = script::parse_commands("0 beam on\n1..20 advance 2 mm\n", "x.gw");
    Habits sloppy;
    sloppy.error = 0;
    sloppy.overshoot = 0.5;
    const Sums plain = played(PlayedHand(script, {}, frame_rate, {0}, 3), {}),
               more = played(PlayedHand(script, {}, frame_rate, sloppy, 3), {});
    EXPECT_NEAR(more.of.at({false, script::DeviceRole::Wire}), 40, 1e-9);
    EXPECT_GT(more.frames, plain.frames + 10);
}

/// The same course by a skilled hand, by one that is unsure, and by a clumsy one. No weight of the grade was
/// chosen by them.
TEST(PlayedHand, SkilledUnsureAndClumsyAreGradedInThatOrder) {
    for (const char* name : {"renal", "bifurcation", "coronary_lad"}) {
        const scenario::Scenario scenario = test::shipped_scenario(name);
        const script::CommandScript solution =
            script::load_commands(test::asset(std::string("scripts/") + name + ".gw"));
        exercise::Exercise exercise(scenario, exercise::Pictures::Dose, test::cache());
        const exercise::Exercise::Snapshot start = exercise.snapshot();
        const auto points = [&](const Habits& habits) {
            exercise.restore(start);
            PlayedHand hand(solution, {}, scenario.frame_rate, habits, 11);
            exercise::StepReport last;
            for (int after = 0; after < 30 && !exercise.completed() && !exercise.time_is_up();
                 after += hand.done())
                last = exercise.next_frame(hand.next(last)).motion;
            EXPECT_TRUE(exercise.completed()) << name;
            return exercise::grade(exercise.finish(), scenario.lesson.benchmark).points;
        };
        Habits unsure, clumsy;
        unsure.decision = 3;
        unsure.overshoot = 0.1;
        clumsy.decision = 8;
        clumsy.overshoot = 0.4;
        const double skilled = points({}), middle = points(unsure), least = points(clumsy);
        EXPECT_GT(skilled, middle + 5) << name;
        EXPECT_GT(middle, least + 5) << name << ": " << skilled << ", " << middle << ", " << least;
    }
}

}  // namespace room
