/// Every metric of the score against the same computed from the frames by other means; and what each kind of
/// waste changes.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/exercise/exercise.h"
#include "engine/exercise/grade.h"
#include "engine/exercise/score.h"
#include "engine/exercise/score_file.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using Json = nlohmann::json;

/// What is seen of a frame from outside.
struct Seen {
    geometry::Vec3 tip;
    double inserted = 0, largest = 0, sum = 0;
    bool moved = false, beam = false;
};

struct Played {
    Score score;
    std::vector<Seen> seen;
    geometry::Vec3 start;
};

Played play(const scenario::Scenario& scenario, const std::string& script) {
    Exercise exercise(scenario, false);
    Played played;
    played.start = exercise.simulation().tip_at_start();
    test::play(exercise, script, [&](const auto&, const std::vector<script::Command>& commands) {
        const Simulation& simulation = exercise.simulation();
        Seen seen{simulation.tip(), simulation.inserted(), 0, 0, false, simulation.console().beam_on()};
        seen.moved = std::any_of(commands.begin(), commands.end(), [](const script::Command& c) {
            return std::holds_alternative<script::Advance>(c) ||
                   std::holds_alternative<script::Withdraw>(c) || std::holds_alternative<script::Rotate>(c);
        });
        const auto contacts = simulation.contacts();
        for (std::size_t i = 1; i < contacts.size(); ++i) {
            seen.largest = std::max(seen.largest, contacts[i].force());
            seen.sum += contacts[i].force();
        }
        played.seen.push_back(seen);
    });
    played.score = exercise.finish();
    return played;
}

/// The figures that differ between two scores by more than rounding, by the names they have in the file.
std::set<std::string> changes(const Score& a, const Score& b) {
    const Json before = Json::parse(to_json({"", "", a, {}, {}})).flatten(),
               after = Json::parse(to_json({"", "", b, {}, {}})).flatten();
    std::set<std::string> keys, found;
    for (const Json* json : {&before, &after})
        for (const auto& [key, value] : json->items()) keys.insert(key);
    for (const std::string& key : keys) {
        const bool both = before.contains(key) && after.contains(key);
        if (both && before[key].is_number() && after[key].is_number()) {
            const double x = before[key], y = after[key];
            if (std::abs(x - y) <= 1e-9 * std::max({1.0, std::abs(x), std::abs(y)})) continue;
        } else if (both && before[key] == after[key]) {
            continue;
        }
        const std::size_t end = key.find('/', 1);
        found.insert(key.substr(1, end == std::string::npos ? end : end - 1));
    }
    return found;
}

/// The tube of the small scenario in the mirror. Its wire is bent across the plane of the mirror's normal,
/// and so stays as it is.
scenario::Scenario mirrored() {
    return test::small_scenario_with("angle_deg = 40.0", "angle_deg = -40.0");
}

const std::string good = "0 beam on\n1..24 advance 2 mm\n40 end\n";

}  // namespace

TEST(ScoreMetrics, EachIsWhatTheFramesSay) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.target.radius = 4;
    const std::string script =
        "2 beam on\n3..14 advance 2 mm\n15 withdraw 3 mm\n17 rotate 20 deg\n20..35 advance 2 mm\n36 beam "
        "off\n"
        "38 inject 2 ml at 4 ml/s into tube\n60 end\n";
    const Played played = play(scenario, script);
    const Score& s = played.score;
    constexpr double dt = 1 / 15.0;
    ASSERT_TRUE(s.completed);
    const int first = 3, completion = static_cast<int>(std::lround((*s.completion_time) / dt)) + first - 1;

    double path = 0, moving_path = 0, force_sum = 0, impulse = 0, peak = 0;
    int over = 0, moving = 0, beam = 0;
    std::vector<double> speeds;
    geometry::Vec3 before = played.start;
    for (int k = 0; k < static_cast<int>(played.seen.size()); ++k) {
        const Seen& seen = played.seen[k];
        const double moved = (seen.tip - before).norm();
        before = seen.tip;
        path += moved;
        force_sum += seen.largest;
        impulse += seen.sum * dt;
        peak = std::max(peak, seen.largest);
        over += seen.largest > HandlingErrorLimits().force;
        beam += seen.beam;
        if (k < first || k > completion) continue;
        speeds.push_back(moved / dt);
        moving += seen.moved;
        moving_path += seen.moved ? moved : 0;
    }
    const auto frames = static_cast<double>(played.seen.size());
    EXPECT_NEAR(s.tip_path, path, 1e-9);
    EXPECT_NEAR(s.mean_tip_speed, moving_path / (moving * dt), 1e-9);
    EXPECT_NEAR(s.idle_fraction, 1 - moving / static_cast<double>(speeds.size()), 1e-12);
    EXPECT_GT(s.idle_fraction, 0);
    EXPECT_NEAR(s.mean_wall_force, force_sum / frames, 1e-12);
    EXPECT_NEAR(s.peak_wall_force, peak, 1e-12);
    EXPECT_NEAR(s.wall_force_impulse, impulse, 1e-9);
    EXPECT_NEAR(s.time_over_force, over * dt, 1e-12);
    EXPECT_NEAR(s.beam_on_time, beam * dt, 1e-12);
    EXPECT_EQ(s.pulses, 34);
    EXPECT_EQ(s.runs, 0);
    EXPECT_EQ(s.views, 1);
    EXPECT_NEAR(s.contrast, 2, 1e-6);
    EXPECT_NEAR(s.advanced, 24 + 32, 1e-6);
    EXPECT_NEAR(s.withdrawn, 3, 1e-9);
    EXPECT_NEAR(s.rotation, 20 * geometry::degree, 1e-9);
    EXPECT_NEAR(s.wire_travel, 24 + 3 + 32, 1e-6);
    EXPECT_EQ(s.reversals, 2);
    EXPECT_NEAR(s.back_and_forth_ratio, 2 * 3.0 / (24 + 3 + 32), 1e-6);
    EXPECT_NEAR(s.duration, 61 * dt, 1e-9);
    for (double& v : speeds) v = static_cast<float>(v);
    EXPECT_NEAR(*s.spectral_arc_length, *spectral_arc_length(speeds, 15), 1e-6);
    EXPECT_NEAR(*s.log_dimensionless_jerk, *log_dimensionless_jerk(speeds, 15), 1e-6);
}

TEST(ScoreMetrics, RunsAndViewsCountWhatTheBeamSaw) {
    const Score s = play(test::small_scenario(),
                         "0 beam on\n4 mode dsa\n8 mask\n12 mode live\n14 arm lao 20 deg\n16 beam off\n"
                         "17 arm lao 40 deg\n18 arm lao 0 deg\n19 beam on\n22 mode dsa\n24 end\n")
                        .score;
    EXPECT_EQ(s.runs, 3);   // begun, a new mask, begun again
    EXPECT_EQ(s.views, 2);  // LAO 40 was never looked at, LAO 0 twice
}

TEST(ScoreMetrics, DoingNothingScoresNothing) {
    scenario::Scenario inside = test::small_scenario();
    inside.target = {"", geometry::Vec3(22, 0, 0), 3.0, 0.2};
    const Score s = play(inside, "30 end\n").score;
    EXPECT_FALSE(s.completed);
    EXPECT_FALSE(s.completion_time);
    for (const double value : {s.beam_on_time, s.contrast, s.wire_travel, s.rotation, s.tip_path,
                               s.idle_fraction, s.mean_tip_speed, s.path_efficiency})
        EXPECT_EQ(value, 0);
    EXPECT_TRUE(s.handling_errors.empty());
    EXPECT_TRUE(s.wrong_branches.empty());
    EXPECT_FALSE(s.spectral_arc_length);
    EXPECT_EQ(grade(s, {}).points, 0);
}

TEST(ScoreMetrics, AMirroredRunScoresTheSame) {
    const std::string script =
        "0 beam on\n1..10 advance 2 mm\n11..13 rotate 15 deg\n14..24 advance 2 mm\n45 end\n";
    std::string turned = script;
    turned.replace(turned.find("rotate 15"), 9, "rotate -15");
    const Score x = play(test::small_scenario(), script).score, y = play(mirrored(), turned).score;
    EXPECT_NEAR(x.tip_path, y.tip_path, 1e-4 * x.tip_path);
    EXPECT_NEAR(x.peak_wall_force, y.peak_wall_force, 1e-3 * x.peak_wall_force);
    EXPECT_NEAR(x.wall_force_impulse, y.wall_force_impulse, 1e-3 * x.wall_force_impulse);
    EXPECT_NEAR(*x.spectral_arc_length, *y.spectral_arc_length, 1e-3);
    EXPECT_NEAR(x.mean_tip_speed, y.mean_tip_speed, 1e-4 * x.mean_tip_speed);
    EXPECT_EQ(x.completed, y.completed);
    EXPECT_EQ(x.completion_time, y.completion_time);
    EXPECT_EQ(x.wire_travel, y.wire_travel);
    EXPECT_EQ(x.handling_errors.size(), y.handling_errors.size());
}

TEST(ScoreMetrics, APauseWorsensWhatTakesTime) {
    const Score quick = play(test::small_scenario(), good).score;
    const Score slow =
        play(test::small_scenario(), "0 beam on\n1..12 advance 2 mm\n23..34 advance 2 mm\n50 end\n").score;
    ASSERT_TRUE(quick.completed && slow.completed);
    EXPECT_EQ(changes(quick, slow),
              (std::set<std::string>{
                  "beam_on_time_s", "completed_after_s", "completion_time_s", "duration_s", "frames",
                  "idle_share", "log_dimensionless_jerk", "max_penetration_at",  // its frame
                  "mean_wall_force_N", "pulses", "spectral_arc_length", "wall_force_impulse_N_s"}));
    EXPECT_GT(*slow.completion_time, *quick.completion_time);
    EXPECT_GT(slow.idle_fraction, quick.idle_fraction);
    EXPECT_LT(*slow.spectral_arc_length, *quick.spectral_arc_length);
}

TEST(ScoreMetrics, ABeamLeftOnWorsensBeamOnly) {
    const Score spared =
        play(test::small_scenario(), "0 beam on\n1..24 advance 2 mm\n32 beam off\n100 end\n").score;
    const Score left = play(test::small_scenario(), "0 beam on\n1..24 advance 2 mm\n100 end\n").score;
    ASSERT_TRUE(spared.completed);
    EXPECT_EQ(changes(spared, left), (std::set<std::string>{"beam_on_time_s", "handling_errors", "pulses"}));
    ASSERT_EQ(left.handling_errors.size(), 1u);
    EXPECT_EQ(left.handling_errors[0].kind, HandlingError::IdleBeam);
}

TEST(ScoreMetrics, ADetourWorsensWayAndTimeButNotTheRest) {
    const Score straight = play(test::small_scenario(), good).score;
    const Score detour =
        play(test::small_scenario(),
             "0 beam on\n1..10 advance 2 mm\n11..15 withdraw 2 mm\n16..34 advance 2 mm\n50 end\n")
            .score;
    ASSERT_TRUE(straight.completed && detour.completed);
    const std::set<std::string> changed = changes(straight, detour);
    for (const char* key :
         {"completed_after_s", "completion_time_s", "wire_travel_mm", "advanced_mm", "withdrawn_mm",
          "reversals", "back_and_forth_ratio", "tip_path_mm", "path_efficiency"})
        EXPECT_TRUE(changed.contains(key)) << key;
    for (const char* key : {"contrast_ml", "rotation_deg", "wrong_branches", "handling_errors", "views",
                            "dsa_runs", "resets", "completed", "buckled_frames"})
        EXPECT_FALSE(changed.contains(key)) << key;
    EXPECT_GT(detour.tip_path, straight.tip_path);
    EXPECT_LT(detour.path_efficiency, 0.8);
    EXPECT_GT(straight.path_efficiency, 0.8);
    const scenario::Benchmark skilled = benchmark_of(std::vector<Score>{straight}, "a test", 0);
    EXPECT_DOUBLE_EQ(grade(straight, skilled).points, 100);
    EXPECT_LT(grade(detour, skilled).points, 100);
}

}  // namespace exercise
