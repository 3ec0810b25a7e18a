/// Everything a user can get wrong: exit code 2, a message that says what and where, and nothing
/// half-written.

#include "engine/anatomy/anatomy_writer.h"
#include "tests/anatomies.h"
#include "tests/app/program.h"

namespace app {
namespace {

using test::asset, test::good_script, test::Outcome, test::read, test::run, test::s_bend_run,
    test::TemporaryFolder, test::write;

struct BadInput : test::InFolder {
    /// Asserts a rejection whose message has `expected` and that left no output folder.
    void expect_refused(const std::vector<std::string>& words, const std::string& expected) const {
        const Outcome result = run(folder, words);
        EXPECT_EQ(result.code, 2) << result.out;
        // Lines of progress come before it where the machine is slow.
        test::expect_said("\n" + result.error, "\nseldinger");
        test::expect_said(result.error, expected);
        EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    }
};

}  // namespace

TEST_F(BadInput, UnknownScenarioIsRefusedWithThoseThatShip) {
    expect_refused({"run", "s_bent", "--commands", good_script, "--out", folder / "out"},
                   "did you mean 's_bend'?");
}

TEST_F(BadInput, MissingCommandFileIsNamed) {
    expect_refused(s_bend_run(folder / "out", {}, folder / "no.gw"), "no.gw: no such command file");
}

TEST_F(BadInput, ScriptsThatCannotBeMadeAreToldWithLineAndColumn) {
    const std::pair<const char*, const char*> cases[] = {
        {"0 beam on\n3 push 5 mm\n", "x.gw:2:3: unknown command 'push'"},
        {"3 advance 5 cm\n", "x.gw:1:13: 'cm' was found; expected the unit 'mm'"},
        {"9 beam on\n3 beam off\n", "x.gw:2:1: '3' was found"},
        {"3 advance nan mm\n", "x.gw:1:11: 'nan' was found"},
        {"3 advance 1e9 mm\n", "expected a number from 0 to 500"},
        {"3 arm sid 500 mm sod 1500 mm\n", "x.gw:1:3"},
        {"3 inject 5 ml at 5 ml/s into nowhere\n", "x.gw:1:3: contrast cannot go into 'nowhere'"},
        {"3 inject 200 ml at 20 ml/s into tube\n9 inject 150 ml at 20 ml/s into tube\n", "x.gw:2:3: 150 ml"},
        {"3 pulse 30 per second\n", "x.gw:1:3: 30 pulses per second were asked for"}};
    for (const auto& [script, expected] : cases) {
        SCOPED_TRACE(script);
        write(folder / "x.gw", script);
        expect_refused(s_bend_run(folder / "out", {}, folder / "x.gw"), expected);
    }
}

TEST_F(BadInput, ScenariosThatCannotBeSetUpAreToldWithTheKey) {
    struct Case {
        const char *scenario, *from, *to, *expected;
    };
    for (const Case& c : std::vector<Case>{
             {"s_bend", "pixels = 256", "pixels = 0", "expected a whole number from 32 to 2048"},
             {"s_bend", "pixels = 256", "pixels = 100000", "expected a whole number from 32 to 2048"},
             {"s_bend", "sid_mm = 1100.0", "sid_mm = 700.0",
              "the isocentre must lie between source and detector"},
             {"s_bend", "inserted_mm", "insertd_mm", ": unknown key 'insertd_mm' in [entry]"},
             {"renal",
              "end = \"aorta+LCIA+LEIA+LCFA.out\"\nflush_catheter = \"aorta\"\ninserted_mm = "
              "80.0\n\n[guidewire]",
              "end = \"LIIA.out\"\ninserted_mm = 35.0\n\n[guidewire]\ndiameter_mm = 4.2",
              "does not enter at 'LIIA.out'"},
             {"s_bend", "name = \"end\"", "centre_mm = [0.0, 0.0, 500.0]",
              "the target is outside the anatomy"}}) {
        SCOPED_TRACE(c.to);
        std::string toml = read(asset(std::string("scenarios/") + c.scenario + ".toml"));
        const auto at = toml.find(c.from);
        ASSERT_NE(at, std::string::npos);
        write(folder / "x.toml", toml.replace(at, std::string(c.from).size(), c.to));
        expect_refused({"run", folder / "x.toml", "--commands", good_script, "--out", folder / "out"},
                       c.expected);
    }
}

TEST_F(BadInput, MeshesThatAreMissingBrokenOrOpenAreTold) {
    const std::filesystem::path stl = folder / "iliac-renal.stl";
    anatomy::write_anatomy(test::iliac_renal(), folder.path(), {});
    std::string toml = read(asset("scenarios/renal.toml")), bytes = read(stl);
    const std::string grown = "[anatomy]\npreset = \"iliac-renal\"\n";
    toml.erase(toml.find(grown), grown.size());
    write(folder / "x.toml", "anatomy = \"iliac-renal.anatomy.json\"\n" + toml);
    const auto refused = [&](const std::string& expected) {
        expect_refused({"run", folder / "x.toml", "--commands", good_script, "--out", folder / "out"},
                       expected);
    };
    // A binary STL is 80 bytes, a count, and 50 bytes a triangle: one lies twice, another is gone.
    write(stl, bytes.replace(84 + 50 * 30'000, 50, bytes.substr(84, 50)));
    refused("the mesh is open at");
    write(stl, "not a mesh at all");
    refused("iliac-renal.stl: 17 bytes were found where");
    std::filesystem::remove(stl);
    refused("iliac-renal.stl: no such mesh can be read");
}

TEST_F(BadInput, FullDiskIsToldAndLeavesOnlyWholeFiles) {
    // A file may grow to one block of 1024 bytes: the recording and score fit, an image does not.
    const Outcome result = test::run_with_small_files(1, folder, s_bend_run(folder / "out"));
    EXPECT_EQ(result.code, 2) << result.error;
    test::expect_said(result.error, "frame_000000.png");
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "out")) {
        EXPECT_NE(entry.path().extension(), ".part") << entry.path();
        EXPECT_NE(entry.path().extension(), ".png") << entry.path();
    }
    const Outcome again = run(folder, s_bend_run(folder / "2", {"--frames", "none"}, folder / "out/run.gw"));
    EXPECT_LT(again.code, 2) << again.error;  // what was recorded is whole
}

TEST_F(BadInput, AngiogramsAndTruthThatCannotBeWrittenAreNamedWithTheCause) {
    // Folders that refuse even the superuser.
    for (const char* part : {"dicom", "truth"}) {
        const std::filesystem::path out = folder / part;
        std::filesystem::create_directory(out);
        std::filesystem::create_symlink("/proc", out / part);
        const bool dicom = std::string(part) == "dicom";
        const Outcome result =
            run(folder, s_bend_run(out, {"--set", "c_arm.pixels=64", dicom ? "--dicom" : "--truth-of",
                                         dicom ? "shown" : "signal,lengths"}));
        EXPECT_EQ(result.code, 2) << result.error;
        test::expect_said(result.error, (out / part / (dicom ? "xa_0001.dcm" : "frame_000000_")).string());
        test::expect_said(result.error, ": cannot be written: No such file or directory");
        EXPECT_TRUE(std::filesystem::is_symlink(out / part));
        EXPECT_FALSE(std::filesystem::exists(out / "score.json"));
    }
}

TEST_F(BadInput, FullDiskLeavesNoPartOfAnAngiogram) {
    // Images of 64 × 64 fit into the limit, many of them in an object do not.
    const Outcome result = test::run_with_small_files(
        40, folder, s_bend_run(folder / "out", {"--set", "c_arm.pixels=64", "--dicom", "signal"}));
    EXPECT_EQ(result.code, 2) << result.error;
    test::expect_said(result.error, "dicom/xa_0001.dcm: cannot be written: File too large");
    // The folder was made for this run and stayed empty.
    EXPECT_FALSE(std::filesystem::exists(folder / "out/dicom"));
    EXPECT_TRUE(std::filesystem::exists(folder / "out/frames/frame_000000.png"));
}

TEST_F(BadInput, PatientOfUnreadableFilesIsToldBeforeARunWithoutImagesBegins) {
    write(folder / "mine.nii", std::string(5000, 'x'));
    std::string text = test::small_toml;
    text.replace(text.find("patient = false"), 15, "[patient]\nct = \"mine.nii\"");
    write(folder / "mine.toml", text);
    write(folder / "late.gw", "40 beam on\n50 end\n");
    const Outcome result = run(folder, {"run", folder / "mine.toml", "--commands", folder / "late.gw",
                                        "--out", folder / "out", "--frames", "none"});
    EXPECT_EQ(result.code, 2) << result.error;
    test::expect_said(result.error, "mine.nii: ");
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(BadInput, WrongArgumentsAreExitCodeTwo) {
    EXPECT_EQ(run(folder, {}).code, 2);
    EXPECT_EQ(run(folder, {"fly"}).code, 2);
    EXPECT_EQ(run(folder, {"run", "s_bend"}).code, 2);
    EXPECT_EQ(run(folder, s_bend_run(folder / "out", {"--every", "0"})).code, 2);
}

}  // namespace app
