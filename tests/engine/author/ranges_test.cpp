#include <cmath>
#include <map>
#include <random>

#include "engine/author/solution.h"
#include "tests/engine/fixtures.h"

namespace author {
namespace {

using script::CommandScript, script::parse_commands;

std::string ranges_of(const std::string& text) {
    const CommandScript script = parse_commands(text, "run.gw");
    return to_text(in_ranges(script), script.end);
}

/// Sums of every motion of every device, and all other commands with their frames.
struct Course {
    std::map<std::string, double> sums;  // [mm], [deg]
    std::vector<std::string> others;
};

Course course_of(const CommandScript& script) {
    Course course;
    for (const script::TimedCommand& timed : script.commands) {
        const auto add = [&](const char* what, script::DeviceRole held, double amount) {
            course.sums[std::string(what) + std::string(script::name_of(held))] += amount;
        };
        if (const auto* push = std::get_if<script::Advance>(&timed.command))
            add("advance ", push->held, push->length);
        else if (const auto* pull = std::get_if<script::Withdraw>(&timed.command))
            add("withdraw ", pull->held, pull->length);
        else if (const auto* turn = std::get_if<script::Rotate>(&timed.command))
            add(turn->angle < 0 ? "right " : "left ", turn->held, std::abs(turn->angle) / geometry::degree);
        else
            course.others.push_back(std::to_string(timed.frame) + " " + script::to_text(timed.command));
    }
    return course;
}

/// What a hand could do: bursts of motion whose amounts swell, tremble or stay, pauses, other commands, all
/// devices.
std::string random_recording(std::mt19937& random) {
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const char* const others[] = {"beam on",         "beam off",           "mode dsa",        "mode live",
                                  "reference",       "arm lao 10 deg",     "grip wire 30 mm", "mask",
                                  "table 0 0 -4 mm", "pulse 15 per second"};
    const char* const devices[] = {"", "catheter ", "all "};
    std::string text;
    for (int frame = 0, burst = 0, verb = 0, device = 0; frame < 120; ++frame) {
        if (burst-- <= 0) burst = 1 + pick(15), verb = pick(5), device = pick(3);
        if (pick(12) == 0) text += fmt::format("{} {}\n", frame, others[pick(10)]);
        const double amount = pick(4) == 0 ? 2.0 : std::ldexp(1 + pick(1 << 20), -18);  // up to 4
        const char* const verbs[] = {"advance", "withdraw", "rotate"};
        if (verb > 3) continue;
        text += fmt::format("{} {} {}{}{} {}\n", frame, verbs[std::min(verb, 2)], devices[device],
                            verb == 3 ? "-" : "", amount, verb < 2 ? "mm" : "deg");
        if (pick(6) == 0) text += fmt::format("{} rotate {} deg\n", frame, amount);
        if (pick(20) == 0) text += fmt::format("{} withdraw {} mm\n", frame, amount);
    }
    return text + "125 end\n";
}

}  // namespace

TEST(Ranges, MergeEqualAndNearlyEqualMotions) {
    EXPECT_EQ(ranges_of("0 beam on\n3 advance 2 mm\n4 advance 2 mm\n5 advance 2 mm\n9 end\n"),
              "0         beam on\n3..5      advance 2 mm\n9         end\n");
    // A hand that speeds up a little, and a turn meanwhile.
    EXPECT_EQ(
        ranges_of("1 advance 0.9 mm\n2 advance 1 mm\n2 rotate 5 deg\n3 advance 1.1 mm\n3 rotate 5 deg\n"),
        "1..3      advance 1 mm\n2..3      rotate 5 deg\n");
    // Not over a pause, and not what is far from equal.
    EXPECT_EQ(ranges_of("1 advance 2 mm\n3 advance 2 mm\n"),
              "1         advance 2 mm\n3         advance 2 mm\n");
    EXPECT_EQ(ranges_of("1 advance 0.1 mm\n2 advance 4 mm\n"),
              "1         advance 0.1 mm\n2         advance 4 mm\n");
}

TEST(Ranges, FramesThatGripOrExchangeStayAsTheyAre) {
    EXPECT_EQ(
        ranges_of("1 advance 2 mm\n2 rotate 3 deg\n2 grip wire 30 mm\n2 advance 2 mm\n3 advance 2 mm\n"),
        "1         advance 2 mm\n2         rotate 3 deg\n2         grip wire 30 mm\n2         advance 2 "
        "mm\n3         advance 2 mm\n");
    EXPECT_EQ(ranges_of("1 advance 2 mm\n1 withdraw 1 mm\n"),
              "1         advance 2 mm\n1         withdraw 1 mm\n");
}

TEST(Ranges, ARecordingWithAResetIsRefused) {
    test::expect_refusal([] { ranges_of("1 advance 2 mm\n5 reset\n"); }, "found a reset in frame 5");
}

TEST(Ranges, ThousandRandomRecordingsKeepSumsOrderAndNearness) {
    for (unsigned seed = 1; seed <= 1000; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const CommandScript recording = parse_commands(random_recording(random), "run.gw");
        const CommandScript merged =
            parse_commands(to_text(in_ranges(recording), recording.end), "ranges.gw");
        const Course was = course_of(recording), is = course_of(merged);
        EXPECT_EQ(is.others, was.others);
        EXPECT_EQ(merged.end, recording.end);
        for (const auto& [what, sum] : was.sums) {
            const auto found = is.sums.find(what);
            EXPECT_NEAR(found == is.sums.end() ? 0.0 : found->second, sum, 1e-3) << what;
        }
        EXPECT_LE(is.sums.size(), was.sums.size());
        // Nowhere on the way is a device farther from where the hand had it than was asked for.
        for (int frame = 0; frame <= 125; frame += 5) {
            const auto until = [frame](CommandScript script) {
                std::erase_if(script.commands, [frame](const auto& timed) { return timed.frame > frame; });
                return course_of(script).sums;
            };
            auto before = until(recording), after = until(merged);
            for (const auto& [what, sum] : before) {
                const bool turns = what.starts_with("left") || what.starts_with("right");
                EXPECT_NEAR(after[what], sum, (turns ? 5.0 : 1.0) + 1e-3) << what << " at frame " << frame;
            }
        }
        if (testing::Test::HasFailure()) break;
    }
}

TEST(Ranges, PairsThatComeToNothingAreFound) {
    const auto pairs = [](const std::string& text) {
        return coming_to_nothing(in_ranges(parse_commands(text, "run.gw"))).size();
    };
    EXPECT_EQ(pairs("1..5 advance 2 mm\n8..12 withdraw 2 mm\n"), 1u);
    EXPECT_EQ(pairs("1..5 rotate 9 deg\n8..12 rotate -9 deg\n"), 1u);
    EXPECT_EQ(pairs("1..5 advance 2 mm\n6 rotate 9 deg\n8..12 withdraw 2 mm\n"), 0u);  // a turn in between
    EXPECT_EQ(pairs("1..5 advance 2 mm\n8..11 withdraw 2 mm\n"), 0u);                  // 2 mm are left
    EXPECT_EQ(pairs("1..5 advance 2 mm\n8..12 withdraw catheter 2 mm\n"), 0u);
}

}  // namespace author
