#include <nlohmann/json.hpp>

#include "tests/app/program.h"

namespace app {
namespace {

using test::asset, test::expect_refused, test::good_script, test::read, test::replaced, test::run,
    test::s_bend_run, test::TemporaryFolder, test::write;

/// A recording of the S-bend's solution.
std::filesystem::path recorded(const TemporaryFolder& folder, const std::string& learner = "") {
    succeeded(folder, s_bend_run(folder / "out", {"--frames", "none", "--learner", learner}));
    return folder / "out/run.gw";
}

}  // namespace

using ScoreCommand = test::InFolder;

TEST_F(ScoreCommand, ComputesTheRunsOwnScoreFromTheRecordingAlone) {
    const std::string file = recorded(folder, "Ada <b>");
    const auto result = succeeded(folder, {"score", file, "--out", folder / "score.json"});
    test::expect_said(result.out, "by Ada <b>");
    test::expect_said(result.out, "all equal");
    EXPECT_EQ(read(folder / "score.json"), read(folder / "out/score.json"));
    EXPECT_EQ(nlohmann::json::parse(read(folder / "score.json"))["learner"], "Ada <b>");
    EXPECT_EQ(run(folder, {"replay", file}).code, 0);
}

TEST_F(ScoreCommand, AChangedStateIsExitCodeThreeAndSaysWhere) {
    const std::string text = read(recorded(folder));
    const std::size_t at = text.find("state 20 ") + 9;
    std::string changed = text;
    changed[at] = changed[at] == '0' ? '1' : '0';
    write(folder / "changed.gw", changed);
    const auto state = run(folder, {"replay", folder / "changed.gw"});
    EXPECT_EQ(state.code, 3);
    test::expect_said(state.error, "frame 20");
    // A command that was taken out leads to other states from there on.
    write(folder / "edited.gw", replaced(text, "advance", "withdraw"));
    EXPECT_EQ(run(folder, {"replay", folder / "edited.gw"}).code, 3);
}

TEST_F(ScoreCommand, ABrokenRecordingIsRefusedWithItsLine) {
    const std::string text = read(recorded(folder));
    write(folder / "x.gw", text.substr(0, text.find("state 20 ") + 12) + "\n");
    expect_refused(run(folder, {"score", folder / "x.gw"}), "x.gw:");
    write(folder / "x.gw", replaced(text, "recording 3", "recording 9"));
    expect_refused(run(folder, {"score", folder / "x.gw"}),
                   "x.gw:1:1: expected 'recording 3' in the first line, found 'recording 9'");
    write(folder / "x.gw", "0 beam on\n5 end\n");
    expect_refused(run(folder, {"score", folder / "x.gw"}), "--scenario");
    expect_refused(run(folder, {"score", folder / "none.gw"}), "none.gw");
}

TEST_F(ScoreCommand, WithoutItsEndItIsScoredAndSaysSo) {
    const std::string text = read(recorded(folder));
    write(folder / "x.gw", text.substr(0, text.find("state 30 ") + 12));  // killed as it wrote
    const auto result = run(folder, {"score", folder / "x.gw"});
    EXPECT_NE(result.code, 2) << result.error;
    test::expect_said(result.error, "has no end");
}

TEST_F(ScoreCommand, AnotherScenarioOrAnatomyIsTold) {
    const std::string file = recorded(folder);
    const std::string toml = read(asset("scenarios/s_bend.toml"));
    write(folder / "s_bend.toml", replaced(toml, "radius_mm = 4.0", "radius_mm = 5.0"));
    const std::string changed = folder / "s_bend.toml";
    expect_refused(run(folder, {"score", file, "--scenario", changed}), "has changed since it was recorded");
    EXPECT_EQ(run(folder, {"score", file, "--scenario", changed, "--force"}).code, 0);
    // Words and comments change nothing.
    write(folder / "s_bend.toml",
          "# A comment.\n" + replaced(replaced(toml, "title = \"", "title = \"Another: "), "hints = [",
                                      "hints = [\"Push.\", "));
    const auto same = succeeded(folder, {"score", file, "--scenario", changed});
    test::expect_said(same.out, "all equal");
    // Another tube.
    write(folder / "s_bend.toml", replaced(toml, "run_mm = 50.0", "run_mm = 51.0"));
    expect_refused(run(folder, {"replay", file, "--scenario", changed}), "has changed since it was recorded");
    // A scenario of another name.
    write(folder / "other.toml", toml);
    expect_refused(run(folder, {"replay", file, "--scenario", folder / "other.toml"}),
                   "recorded in the scenario");
    // The same scenario, whose file of vessels has changed.
    const auto grow = [&](const std::string& radius) {
        write(folder / "tree.toml", "schema = 1\n[[branch]]\nname = \"v\"\npoints_mm = [[0, 0, 0, " + radius +
                                        "], [0, 0, 80, " + radius + "]]\n");
    };
    const std::string own = folder / "own.toml", grown = folder / "grown/run.gw";
    write(own,
          "schema = 1\ntitle = \"own\"\n[anatomy]\ntree = \"tree.toml\"\n[entry]\nend = \"v.in\"\n"
          "inserted_mm = 40.0\n[target]\ncentre_mm = [0, 0, 60]\n");
    write(folder / "own.gw", "0 beam on\n1 advance 2 mm\n3 end\n");
    grow("3");
    EXPECT_LE(run(folder, {"run", own, "--commands", folder / "own.gw", "--frames", "none", "--out",
                           folder / "grown"})
                  .code,
              1);
    EXPECT_EQ(run(folder, {"replay", grown, "--scenario", own}).code, 0);
    grow("4");
    for (const char* command : {"replay", "score"})
        expect_refused(run(folder, {command, grown, "--scenario", own}),
                       "the anatomy has changed since it was recorded");
}

TEST_F(ScoreCommand, ALearnersNameWithControlCharactersOrNotInUtf8IsRefused) {
    expect_refused(run(folder, s_bend_run(folder / "out", {"--learner", "A\x1b[31m"})), "--learner");
    expect_refused(run(folder, s_bend_run(folder / "out", {"--learner", "\xc4nna"})), "--learner");
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(ListCommand, DescribesAScenario) {
    const TemporaryFolder folder;
    const auto result = succeeded(folder, {"list", "s_bend", "--cache", folder / "cache"});
    for (const char* word : {"S-bend", "target", "start", "wire", "wall", "end", "branch"})
        EXPECT_NE(result.out.find(word), std::string::npos) << word << "\n" << result.out;
    expect_refused(run(folder, {"list", "s_bent"}), "s_bend");
}

}  // namespace app
