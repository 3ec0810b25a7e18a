/// A case planned as a user plans it: from vessels to a course that the other commands take.

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/app/program.h"
#include "tests/engine/plan/fork.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using test::expect_refused, test::joined, test::Outcome, test::read, test::write;

const std::vector<std::string> cache = {"--cache", SELDINGER_SOURCE "/build/cache"};

struct PlanCommand : test::InFolder {
    void SetUp() override { write(folder / "fork.toml", test::fork_toml()); }
    Outcome plan(const std::vector<std::string>& more, const std::string& out = "plan",
                 const std::string& frames = "3000") const {
        return test::run(
            folder, joined(joined({"plan", "fork.toml", "--out", out, "--frames", frames}, cache), more));
    }
};

nlohmann::json ranked(const test::TemporaryFolder& folder, const std::string& out = "plan") {
    return nlohmann::json::parse(read(folder / (out + "/plan.json")))["ranked"];
}

}  // namespace

/// From vessels to a page, and to a course that runs, replays and is an exercise with its solution.
TEST_F(PlanCommand, TheBestCourseIsAScriptThatRunAndReplayTake) {
    const Outcome made = plan({"--devices", "glidestraight035,own"});
    ASSERT_EQ(made.code, 0) << made.out << made.error;
    test::expect_said(made.out, "passes in trunk");
    const auto all = ranked(folder);
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0]["devices"], "own");
    EXPECT_TRUE(all[0]["reached"].get<bool>());
    EXPECT_FALSE(all[1]["reached"].get<bool>());
    EXPECT_GT(all[0]["sensitivities"].size(), 4u);
    EXPECT_TRUE(all[0]["air_kerma_mGy"].is_number());
    for (const char* known : {"tip_error_mm", "tip_error_wall_mm", "wall_error_mm"})
        EXPECT_TRUE(all[0][known].is_number()) << known << ": " << all[0][known];
    // Its shaft winds up and its vessels make way, or there is a figure of what that leaves out.
    for (const char* maybe : {"tip_error_vessels_mm", "tip_error_twist_mm"})
        EXPECT_TRUE(all[0].contains(maybe)) << maybe;
    // Run elsewhere, by its files alone.
    const Outcome ran = test::run(folder, joined({"run", "plan/best.toml", "--commands", "plan/best.gw",
                                                  "--out", "ran", "--frames", "none"},
                                                 cache));
    EXPECT_EQ(ran.code, 0) << ran.out << ran.error;
    const auto score = nlohmann::json::parse(read(folder / "ran/score.json"));
    EXPECT_EQ(score["peak_wall_force_N"], all[0]["peak_wall_force_N"]);
    EXPECT_EQ(score["contrast_ml"], all[0]["contrast_ml"]);
    EXPECT_EQ(score["air_kerma_mGy"], all[0]["air_kerma_mGy"]);
    EXPECT_EQ(score["angiograms"], 2) << "of the trunk and of the branch";
    const Outcome replayed =
        test::run(folder, joined({"replay", "ran/run.gw", "--scenario", "plan/best.toml"}, cache));
    EXPECT_EQ(replayed.code, 0) << replayed.out << replayed.error;
    // "Show me" shows what lies beside an exercise under its name.
    test::expect_said(test::run(folder, {"list", "--exercises", "plan"}).out, "best");
    const Outcome shown = test::run(folder, joined({"run", "best", "--exercises", "plan", "--commands",
                                                    "solution", "--out", "shown", "--frames", "none"},
                                                   cache));
    EXPECT_EQ(shown.code, 0) << shown.out << shown.error;
    const std::string page = read(folder / "plan/plan.html");
    for (const char* said :
         {"1 of 2 sets of devices reach", "Where the others fail", "What makes the way hard",
          "What the best course depends on", "How sure", "the wall's field in place of the lumen's mesh",
          "rigid shafts", "What was not tried", "from the left"})
        test::expect_said(page, said);
    for (const char* number : {"nan&nbsp;", "inf&nbsp;", ">nan", ">inf"})
        EXPECT_EQ(page.find(number), std::string::npos);
    EXPECT_EQ(page.find("src=\"http"), std::string::npos);
}

TEST_F(PlanCommand, AnExchangeOfTheWireIsInTheCourseThatRunAndReplayTake) {
    const Outcome made =
        plan({"--devices", "glidestraight035+guide6f", "--exchange", "glide035,v18,lunderquist035"}, "plan",
             "36000");
    ASSERT_EQ(made.code, 0) << made.out << made.error;
    const auto all = ranked(folder);
    EXPECT_EQ(all[0]["exchanges"], 1);
    EXPECT_TRUE(all[0]["not_tried"].empty());
    test::expect_said(read(folder / "plan/best.gw"), "exchange wire ");
    const Outcome ran = test::run(folder, joined({"run", "plan/best.toml", "--commands", "plan/best.gw",
                                                  "--out", "ran", "--frames", "none"},
                                                 cache));
    EXPECT_EQ(ran.code, 0) << ran.out << ran.error;
    EXPECT_EQ(nlohmann::json::parse(read(folder / "ran/score.json"))["peak_wall_force_N"],
              all[0]["peak_wall_force_N"]);
    const Outcome replayed =
        test::run(folder, joined({"replay", "ran/run.gw", "--scenario", "plan/best.toml"}, cache));
    EXPECT_EQ(replayed.code, 0) << replayed.out << replayed.error;
    // Where nothing keeps its place, or what does is too narrow, the plan says so.
    ASSERT_EQ(plan({"--exchange", "rosen035"}, "bare", "1000").code, 0);
    test::expect_said(read(folder / "bare/plan.html"), "nothing lies around it that would keep its place");
    plan({"--devices", "floppy014+micro17", "--exchange", "rosen035"}, "narrow", "1000");
    ASSERT_EQ(ranked(folder, "narrow")[0]["not_tried"].size(), 1u);
    test::expect_said(ranked(folder, "narrow")[0]["not_tried"][0].get<std::string>(), "does not fit a lumen");
    expect_refused(plan({"--exchange", "cobra5f"}), "expected wires, found 'cobra5f', a catheter");
    expect_refused(plan({"--exchange", "glide,"}), "--exchange");
}

TEST_F(PlanCommand, AngiogramsEndWithThePatientsContrast) {
    for (const double limit : {4.0, 7.0, 10.0, 100.0}) {
        write(folder / "fork.toml",
              test::replaced(test::fork_toml(), "[imaging]",
                             fmt::format("[contrast]\nlimit_ml = {}\n[imaging]", limit)));
        const std::string out = fmt::format("limit{:.0f}", limit);
        ASSERT_EQ(plan({}, out).code, 0);
        EXPECT_NEAR(ranked(folder, out)[0]["contrast_ml"].get<double>(),
                    std::min(10.0, 5 * std::floor(limit / 5)), 1e-9)
            << limit;
    }
}

TEST_F(PlanCommand, WhereTimeLeavesNoneThereIsNoAngiogramAndTheCourseReaches) {
    ASSERT_EQ(plan({}, "free").code, 0);
    const auto usual = ranked(folder, "free")[0];
    const double later = 2 * (5 / 2.0 + 1), limit = usual["time_s"].get<double>() - 0.5 * later;
    write(folder / "fork.toml",
          test::replaced(test::fork_toml(), "seed = 1", fmt::format("seed = 1\ntime_limit_s = {}", limit)));
    ASSERT_EQ(plan({}, "short").code, 0);
    const auto hurried = ranked(folder, "short")[0];
    EXPECT_TRUE(hurried["reached"].get<bool>());
    EXPECT_EQ(hurried["contrast_ml"], 0);
    EXPECT_EQ(hurried["left_out"].size(), usual["left_out"].size());
}

TEST_F(PlanCommand, ShardsMergedAreTheWholePlanAndWhatWasMadeIsNotMadeAgain) {
    const std::vector<std::string> devices = {"--devices", "own,glidestraight035,rosen035"};
    ASSERT_EQ(plan(devices, "whole", "1000").code, 0);
    const int first = plan(joined(devices, {"--shard", "1/2"}), "a", "1000").code;
    const int second = plan(joined(devices, {"--shard", "2/2", "--threads", "1"}), "b", "1000").code;
    EXPECT_TRUE(first <= 1 && second <= 1);
    ASSERT_EQ(test::run(folder, joined({"plan", "merge", "a", "b", "--out", "all"}, cache)).code, 0);
    for (const char* file : {"plan.csv", "plan.json", "best.gw", "best.toml"})
        EXPECT_EQ(read(folder / (std::string("all/") + file)), read(folder / (std::string("whole/") + file)))
            << file;
    const Outcome again = plan(devices, "whole", "1000");
    test::expect_said(again.out, "3 of 3 made before");
    // Another seed is another plan.
    const Outcome other = plan(joined(devices, {"--seed", "5"}), "whole", "1000");
    EXPECT_EQ(other.out.find("made before"), std::string::npos);
    expect_refused(plan(joined(devices, {"--shard", "4/4"}), "c"), "expected at most 3 shards");
    expect_refused(test::run(folder, {"plan", "merge", "a", "a", "--out", "twice"}),
                   "expected each set of devices once");
    expect_refused(test::run(folder, {"plan", "merge", "a", "--out", "half"}),
                   "expected all shares, found none with");
    expect_refused(test::run(folder, {"plan", "merge", "whole", "--out", "half"}),
                   "expected a folder of 'plan --shard'");
    expect_refused(test::run(folder, {"plan", "merge", "nowhere", "--out", "twice"}), "found none");
}

TEST_F(PlanCommand, SaysWhatIsWrongAndHowNearItGot) {
    expect_refused(plan({"--to", "nowhere"}), "expected a target or a branch");
    expect_refused(plan({"--from", "nowhere"}), "expected an open end");
    expect_refused(plan({"--devices", "glide"}), "glide");
    expect_refused(plan({"--devices", "cobra5f"}), "expected a wire first");
    expect_refused(plan({"--most-force", "nan"}), "--most-force");
    expect_refused(plan({"--frames", "10"}), "--frames");
    expect_refused(plan({"--time-limit", "0"}), "--time-limit");
    expect_refused(test::run(folder, {"plan", "fork.gw", "--out", "x"}), "fork.gw");
    // A catheter that the vessels do not take is no error of the plan: others may fit.
    const Outcome thick = plan({"--devices", "glide035+sheath12f,own"}, "thick");
    EXPECT_EQ(thick.code, 0) << thick.out << thick.error;
    // Where nothing can begin, that is the error, and no plan is written.
    write(folder / "outside.toml", test::replaced(test::fork_toml(), "name = \"goal\"\nradius_mm",
                                                  "centre_mm = [90, 0, 0]\nradius_mm"));
    expect_refused(test::run(folder, joined({"plan", "outside.toml", "--out", "outside"}, cache)),
                   "the target is outside the anatomy");
    EXPECT_FALSE(fs::exists(folder / "outside/plan.html"));
    // A target that no wire reaches: how near.
    const Outcome far = plan({"--devices", "glidestraight035"}, "far");
    EXPECT_EQ(far.code, 1);
    test::expect_said(far.out, "nearest");
    test::expect_said(read(folder / "far/plan.html"), "No course was found that reaches the target.");
    EXPECT_FALSE(fs::exists(folder / "far/best.gw"));
    // A best course of an earlier plan does not stay, and no plan replaces what it is made from.
    ASSERT_EQ(plan({}, "again").code, 0);
    EXPECT_EQ(plan({"--devices", "glidestraight035"}, "again").code, 1);
    EXPECT_FALSE(fs::exists(folder / "again/best.gw"));
    ASSERT_EQ(plan({}, "own").code, 0);
    expect_refused(test::run(folder, joined({"plan", "own/best.toml", "--out", "own"}, cache)), "best.toml");
    // Limits: what is beyond them is marked.
    const Outcome limited = plan({"--most-force", "0.001"}, "limited");
    EXPECT_EQ(limited.code, 0);
    test::expect_said(limited.out, "limit");
    EXPECT_FALSE(ranked(folder, "limited")[0]["within_limits"].get<bool>());
}

/// Words that nobody chose: it answers with a plan or a sentence.
TEST_F(PlanCommand, WildArgumentsAreRefusedOrPlanned) {
    const unsigned seed = 47;
    std::mt19937 random(seed);
    const std::vector<std::string> parts = {"side",      ":",     ",",  "-1",   "1e9", "goal", "nan",
                                            "trunk.out", "0",     "20", "inf",  "\"",  "+",    "glide035",
                                            "own",       "wires", "\n", "../x", "%",   "é"};
    for (int k = 0; k < 40; ++k) {
        const auto word = [&] {
            std::string text;
            for (unsigned part = 0; part <= random() % 3; ++part) text += parts[random() % parts.size()];
            return text;
        };
        const char* options[] = {"--to", "--from", "--devices", "--shard", "--seed"};
        const std::vector<std::string> more = {options[random() % 5], word(), "--time-limit", "1"};
        const Outcome outcome = plan(more, fmt::format("wild{}", k));
        EXPECT_TRUE(outcome.code >= 0 && outcome.code <= 2)
            << "seed " << seed << ", case " << k << ": " << more[0] << " '" << more[1]
            << "': " << outcome.code << " " << outcome.error;
    }
}

}  // namespace app
