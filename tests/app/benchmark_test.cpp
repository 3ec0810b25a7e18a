#include "tests/app/program.h"

namespace app {
namespace {

using test::expect_refused, test::expect_said, test::read, test::run, test::s_bend_run, test::succeeded,
    test::write;

class BenchmarkCommand : public test::InFolder {
protected:
    void SetUp() override { setenv("XDG_DATA_HOME", (folder / "data").c_str(), 1); }
    void TearDown() override { unsetenv("XDG_DATA_HOME"); }
};

}  // namespace

TEST_F(BenchmarkCommand, OfATeachersOwnRecordingsGradesAllOthersFromThenOn) {
    succeeded(folder, s_bend_run(folder / "skilled/1", {"--frames", "none"}));
    succeeded(folder, s_bend_run(folder / "skilled/2", {"--frames", "none"}));
    // A third one, which a teacher helped, is left out with a word.
    write(folder / "helped.gw", "0 teacher target on\n" + read(test::asset("scripts/s_bend.gw")));
    succeeded(folder, {"run", "s_bend", "--commands", folder / "helped.gw", "--frames", "none", "--out",
                       folder / "skilled/3"});
    const auto made = succeeded(folder, {"benchmark", folder / "skilled", "--by", "Dr Ada, two attempts",
                                         "--out", folder / "b.toml"});
    expect_said(made.out, "s_bend: 2 attempts");
    expect_said(made.error, "a teacher helped or hindered");
    expect_said(read(folder / "b.toml"), "Dr Ada, two attempts");
    // Without --out it goes to the user's data, and is used from then on.
    expect_said(succeeded(folder, {"score", folder / "skilled/1/run.gw"}).out, "a program");
    succeeded(folder, {"benchmark", folder / "skilled", "--by", "Dr Ada, two attempts"});
    const auto score = succeeded(folder, {"score", folder / "skilled/1/run.gw"});
    expect_said(score.out, "2 attempts by Dr Ada, two attempts");
    expect_said(score.out, "100 of 100");
}

TEST_F(BenchmarkCommand, OfPlayedAttemptsIsTheSameEveryTimeAndKeepsTheOthers) {
    write(folder / "b.toml", "schema = 1\n[other]\nby = \"x\"\nattempts = 1\n");
    const std::vector<std::string> play = {
        "benchmark", "--played",        "2",      "--of",         "straight",
        "--out",     folder / "b.toml", "--keep", folder / "kept"};
    succeeded(folder, play);
    const std::string first = read(folder / "b.toml");
    expect_said(first, "[other]");
    expect_said(first, "[straight]");
    // What was kept is not replaced.
    const std::string kept = read(folder / "kept/straight-001.gw");
    expect_refused(run(folder, play), "straight-001.gw is there already");
    EXPECT_EQ(read(folder / "kept/straight-001.gw"), kept);
    std::filesystem::remove_all(folder / "kept");
    expect_said(succeeded(folder, play).out, "in place of earlier ones");
    EXPECT_EQ(read(folder / "b.toml"), first);
    expect_said(succeeded(folder, {"replay", folder / "kept/straight-001.gw"}).out, "all equal");
    // What was kept makes the same benchmark, as anybody's recordings do.
    succeeded(folder, {"benchmark", folder / "kept", "--by", "x", "--out", folder / "again.toml"});
    const auto figures = [](const std::string& text) { return text.substr(text.find("completed_after_s")); };
    EXPECT_EQ(figures(read(folder / "again.toml")), figures(first.substr(first.find("[straight]"))));
}

TEST_F(BenchmarkCommand, WhatIsWrongIsRefusedAndNothingChanges) {
    succeeded(folder, s_bend_run(folder / "skilled", {"--frames", "none"}));
    expect_refused(run(folder, {"benchmark"}), "expected either");
    expect_refused(run(folder, {"benchmark", folder / "skilled"}), "--by is missing");
    expect_refused(run(folder, {"benchmark", folder / "none", "--by", "x"}), "none");
    expect_refused(run(folder, {"benchmark", "--played", "1", "--of", "renl"}), "renal");
    write(folder / "b.toml", "schema = 1\n[s_bend]\n");
    expect_refused(run(folder, {"benchmark", folder / "skilled", "--by", "x", "--out", folder / "b.toml"}),
                   "b.toml:2");
    EXPECT_EQ(read(folder / "b.toml"), "schema = 1\n[s_bend]\n");
    // An attempt that missed is none.
    write(folder / "miss.gw", "0 beam on\n1..5 advance 1 mm\n20 end\n");
    run(folder,
        {"run", "s_bend", "--commands", folder / "miss.gw", "--frames", "none", "--out", folder / "missed"});
    const auto missed =
        run(folder, {"benchmark", folder / "missed", "--by", "x", "--out", folder / "c.toml"});
    EXPECT_EQ(missed.code, 2);
    expect_said(missed.error, "no attempt reached");
    EXPECT_FALSE(std::filesystem::exists(folder / "c.toml"));
}

}  // namespace app
