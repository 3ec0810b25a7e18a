#include <algorithm>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/app/program.h"

namespace app {
namespace {

using test::asset, test::good_script, test::names_in, test::Outcome, test::read, test::run, test::s_bend_run,
    test::Started, test::TemporaryFolder, test::write;

}  // namespace

using RunCommand = test::InFolder;

TEST_F(RunCommand, ReachesTheTargetAndLeavesItsFiles) {
    const auto result = succeeded(folder, s_bend_run(folder / "out"));
    // No progress bar where there is no terminal; lines, should the machine be so slow.
    EXPECT_EQ(result.error.find_first_of("\r\033"), std::string::npos) << result.error;
    const auto score = nlohmann::json::parse(read(folder / "out/score.json"));
    EXPECT_TRUE(score["completed"].get<bool>());
    EXPECT_GT(score["completion_time_s"].get<double>(), 0);
    EXPECT_EQ(score["frames"], 41);
    EXPECT_NEAR(score["beam_on_time_s"].get<double>(), 41 / 15.0, 1e-9);
    EXPECT_EQ(names_in(folder / "out/frames").size(), 41u);
    EXPECT_EQ(names_in(folder / "out/frames").back(), "frame_000040.png");
    EXPECT_TRUE(std::filesystem::exists(folder / "out/sheet.png"));
}

TEST_F(RunCommand, ShippedScriptGoesFromTheGroinToTheAorta) {
    succeeded(folder, {"run", "iliac_aorta", "--commands", asset("scripts/iliac_aorta.gw"), "--out",
                       folder / "out", "--frames", "none"});
    const auto score = nlohmann::json::parse(read(folder / "out/score.json"));
    EXPECT_LT(score["max_penetration_mm"].get<double>(), 0.2);
}

TEST_F(RunCommand, TargetNotReachedIsExitCodeOne) {
    write(folder / "x.gw", "0 advance 2 mm\n5 end\n");
    const auto result = run(folder, s_bend_run(folder / "out", {"--frames", "none"}, folder / "x.gw"));
    EXPECT_EQ(result.code, 1) << result.error;
    EXPECT_FALSE(nlohmann::json::parse(read(folder / "out/score.json"))["completed"].get<bool>());
    EXPECT_FALSE(std::filesystem::exists(folder / "out/frames"));
    EXPECT_FALSE(std::filesystem::exists(folder / "out/sheet.png"));
}

TEST_F(RunCommand, EveryKthFrameIsWritten) {
    run(folder, s_bend_run(folder / "out", {"--every", "20"}));
    EXPECT_EQ(names_in(folder / "out/frames"),
              (std::vector<std::string>{"frame_000000.png", "frame_000020.png", "frame_000040.png"}));
}

TEST_F(RunCommand, TwiceGivesTheSameBytes) {
    for (const char* out : {"1", "2"}) {
        run(folder, s_bend_run(folder / out, {"--every", "8"}));
    }
    for (const std::string& name : names_in(folder / "1/frames")) {
        EXPECT_EQ(read(folder / ("1/frames/" + name)), read(folder / ("2/frames/" + name))) << name;
    }
    EXPECT_FALSE(read(folder / "1/run.gw").empty());
    for (const char* name : {"run.gw", "score.json", "sheet.png"}) {
        EXPECT_EQ(read(folder / "1" / name), read(folder / "2" / name)) << name;
    }
}

TEST_F(RunCommand, ReplayOfItsRecordingAgreesInStatesAndFrames) {
    run(folder, s_bend_run(folder / "1", {"--every", "10"}));
    const auto again = succeeded(
        folder, s_bend_run(folder / "2", {"--every", "10", "--expect", folder / "1"}, folder / "1/run.gw"));
    test::expect_said(again.out, "5 frames compared, all equal");
}

TEST_F(RunCommand, DifferenceFromWhatWasExpectedIsExitCodeThree) {
    run(folder, s_bend_run(folder / "1", {"--frames", "none"}));
    std::string script = read(good_script);
    script.replace(script.find("rotate 20"), 9, "rotate 21");
    write(folder / "x.gw", script);
    const auto other =
        run(folder,
            s_bend_run(folder / "2", {"--frames", "none", "--expect", folder / "1/run.gw"}, folder / "x.gw"));
    EXPECT_EQ(other.code, 3);
    test::expect_said(other.error, "the state of frame 20 is");
}

TEST_F(RunCommand, ChangedPixelIsExitCodeThree) {
    run(folder, s_bend_run(folder / "1", {"--every", "20"}));
    std::filesystem::copy_file(folder / "1/frames/frame_000000.png", folder / "1/frames/frame_000020.png",
                               std::filesystem::copy_options::overwrite_existing);
    const auto result = run(folder, s_bend_run(folder / "2", {"--every", "20", "--expect", folder / "1"}));
    EXPECT_EQ(result.code, 3);
    test::expect_said(result.error, "frame 20 differs");
}

TEST_F(RunCommand, CtrlCLeavesARecordingThatReplays) {
    for (const int number : {SIGINT, SIGTERM}) {
        const TemporaryFolder fresh;
        // Whatever frame it is stopped in, what is left must replay.
        const Started started = test::endless_run(fresh, "1", 10);
        started.signal(number);
        const auto result = started.wait();
        EXPECT_EQ(result.code, 130) << result.error;
        const auto score = nlohmann::json::parse(read(fresh / "1/score.json"));
        EXPECT_TRUE(score["interrupted"].get<bool>());
        const auto again =
            run(fresh, s_bend_run(fresh / "2", {"--frames", "none", "--expect", fresh / "1/run.gw"},
                                  fresh / "1/run.gw"));
        EXPECT_EQ(again.code, 1) << again.error;
        EXPECT_EQ(nlohmann::json::parse(read(fresh / "2/score.json"))["frames"], score["frames"]);
    }
}

TEST_F(RunCommand, KilledProgramLeavesARecordingThatReplays) {
    const Started started = test::endless_run(folder, "1", 20);
    started.signal(SIGKILL);
    EXPECT_EQ(started.wait().code, 1000 + SIGKILL);
    const auto again = run(folder, s_bend_run(folder / "2", {"--frames", "none"}, folder / "1/run.gw"));
    EXPECT_EQ(again.code, 1) << again.error;  // not 3: the states agree
}

TEST(List, NamesTheShippedScenariosOneALine) {
    const TemporaryFolder folder;
    const auto result = succeeded(folder, {"list"});
    test::expect_said(result.out, "s_bend ");
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(asset("scenarios"))) {
        files += entry.path().extension() == ".toml" && entry.path().filename() != "benchmark.toml";
    }
    EXPECT_EQ(static_cast<std::size_t>(std::count(result.out.begin(), result.out.end(), '\n')), files + 1);
}

TEST(Program, TellsItsVersionAndUse) {
    const TemporaryFolder folder;
    EXPECT_EQ(run(folder, {"--version"}).code, 0);
    EXPECT_EQ(run(folder, {"--version"}).out.find("seldinger "), 0u);
    const auto help = run(folder, {"run", "--help"});
    EXPECT_EQ(help.code, 0);
    test::expect_said(help.out, "--commands");
    test::expect_said(help.out, "Exit codes");
}

/// The way of a run's angiograms to a disc: dcmmkdir makes its directory, dciodvfy holds them against the
/// standard.
TEST_F(RunCommand, AngiogramsAreTakenByADicomdirAndByAValidator) {
    if (std::system("dcmmkdir --version >/dev/null 2>&1") != 0 ||
        std::system("command -v dciodvfy >/dev/null") != 0)
        GTEST_SKIP() << "dcmmkdir or dciodvfy is not installed";
    write(folder / "x.gw",
          "0 beam on\n1 mode dsa\n4 inject 4 ml at 8 ml/s into tube of 250 mg/ml\n12 beam off\n14 mode "
          "live\n15 beam on\n"
          "16..18 advance 2 mm\n24 end\n");
    for (const std::string pixels : {"shown", "signal"}) {
        const std::filesystem::path disc = folder / ("disc-" + pixels);
        const Outcome made = run(folder, s_bend_run(folder / pixels, {"--dicom", pixels}, folder / "x.gw"));
        ASSERT_LE(made.code, 1) << made.error;
        std::filesystem::create_directory(disc);
        int number = 0;
        for (const auto& entry : std::filesystem::directory_iterator(folder / pixels / "dicom"))
            std::filesystem::copy_file(entry.path(),
                                       disc / ("XA" + std::to_string(++number)));  // as a disc names them
        ASSERT_GE(number, 2);
        const auto tool = [&](const std::vector<std::string>& words) {
            return Started(folder, words).wait();
        };
        const Outcome listed = tool({"bash", "-c", "cd \"$0\" && dcmmkdir +r *", disc});
        EXPECT_EQ(listed.code, 0) << listed.error << listed.out;
        EXPECT_GT(std::filesystem::file_size(disc / "DICOMDIR"), 500u);
        bool agent = false;
        for (int k = 1; k <= number; ++k) {
            const std::string file = disc / ("XA" + std::to_string(k));
            const Outcome judged = tool({"dciodvfy", file});
            EXPECT_EQ((judged.out + judged.error).find("Error"), std::string::npos)
                << judged.out << judged.error;
            agent |= tool({"dcmdump", "+P", "0018,1049", file}).out.find("[250]") != std::string::npos;
        }
        EXPECT_TRUE(agent) << "the agent's own concentration, not the blood's";
    }
}

/// As a hospital's test archive gets them: by the network, with the date and the patient of an exercise.
TEST_F(RunCommand, AngiogramsOfADateAndAPatientAreStoredByAnArchive) {
    if (std::system("storescp --version >/dev/null 2>&1") != 0 ||
        std::system("command -v dciodvfy >/dev/null") != 0)
        GTEST_SKIP() << "storescp or dciodvfy is not installed";
    write(folder / "x.gw", "0 beam on\n4 inject 4 ml at 8 ml/s into tube of 250 mg/ml\n12 end\n");
    const auto made_with = [&](const std::vector<std::string>& more, const std::string& to) {
        std::vector<std::string> words = {"--dicom", "shown"};
        words.insert(words.end(), more.begin(), more.end());
        return run(folder, s_bend_run(folder / to, words, folder / "x.gw"));
    };
    const Outcome made =
        made_with({"--dicom-date", "2026-11-27T14:05:00", "--dicom-patient", "Doe^Jane^A,4711"}, "out");
    ASSERT_LE(made.code, 1) << made.error;
    // Any free port; storescp says nothing until it has one.
    std::filesystem::create_directory(folder / "archive");
    const std::string script =
        "for port in $(shuf -i 20000-60000 -n 20 --random-source=<(yes)); do "
        "storescp -od \"$0\" +xa $port & server=$!; "
        "for wait in 1 2 3 4 5 6 7 8 9 10; do "
        "if storescu 127.0.0.1 $port \"$1\"; then sent=yes; break; fi; kill -0 $server || break; sleep 0.2; "
        "done; "
        "kill $server; wait $server; [ -z \"$sent\" ] || exit 0; done; exit 1";
    const std::string file = folder / "out/dicom/xa_0001.dcm";
    const Outcome stored =
        Started(folder, std::vector<std::string>{"bash", "-c", script, folder / "archive", file}).wait();
    EXPECT_EQ(stored.code, 0) << stored.error << stored.out;
    std::vector<std::string> kept;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "archive"))
        kept.push_back(entry.path());
    ASSERT_EQ(kept.size(), 1u);
    const auto tool = [&](const std::vector<std::string>& words) { return Started(folder, words).wait(); };
    const std::string all = tool({"dcmdump", kept[0]}).out;
    for (const char* said : {"[20261127]", "[140500]", "[Doe^Jane^A]", "[4711]"})
        test::expect_said(all, said);
    const Outcome judged = tool({"dciodvfy", file});
    EXPECT_EQ((judged.out + judged.error).find("Error"), std::string::npos) << judged.out << judged.error;

    for (const char* wrong : {"2026-13-01", "2026-02-30", "yesterday", "20261127T25", "2026-11-27T12:60:00"})
        test::expect_said(made_with({"--dicom-date", wrong}, "none").error,
                          std::string("--dicom-date: '") + wrong + "' was given; expected a date");
    for (const char* wrong : {"a\\b", "a=b", "a^b^c^d^e^f"})
        test::expect_said(made_with({"--dicom-patient", wrong}, "none").error,
                          "expected a name such as Doe^Jane");
    EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

}  // namespace app
