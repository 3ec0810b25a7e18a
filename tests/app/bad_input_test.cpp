/// Everything a user can get wrong: exit code 2, a message that says what and where, and nothing
/// half-written.

#include <functional>

#include "engine/anatomy/anatomy_writer.h"
#include "tests/anatomies.h"
#include "tests/app/program.h"

namespace app {
namespace {

using test::asset, test::good_script, test::Outcome, test::read, test::run, test::s_bend_run,
    test::TemporaryFolder, test::write;

/// Asserts a rejection whose message has `expected` and that left no output folder.
void expect_refused(const Outcome& result, const TemporaryFolder& folder, const std::string& expected) {
    EXPECT_EQ(result.code, 2) << result.out;
    // Lines of progress come before it where the machine is slow.
    const std::size_t begin = ("\n" + result.error).find("\nseldinger: ");
    EXPECT_NE(begin, std::string::npos) << result.error;
    test::expect_said(result.error, expected);
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

void expect_script_refused(const std::string& script, const std::string& expected) {
    const TemporaryFolder folder;
    write(folder / "x.gw", script);
    expect_refused(run(folder, s_bend_run(folder / "out", {}, folder / "x.gw")), folder, expected);
}

/// The shipped scenario with `from` replaced.
void expect_scenario_refused(const std::string& name, const std::string& from, const std::string& to,
                             const std::string& expected) {
    const TemporaryFolder folder;
    std::string toml = read(asset("scenarios/" + name));
    const auto at = toml.find(from);
    ASSERT_NE(at, std::string::npos);
    write(folder / "x.toml", toml.replace(at, from.size(), to));
    expect_refused(
        run(folder, {"run", folder / "x.toml", "--commands", good_script, "--out", folder / "out"}), folder,
        expected);
}

/// The iliac arteries as files, after `change` to their mesh.
void expect_mesh_refused(const std::function<void(const std::filesystem::path& stl)>& change,
                         const std::string& expected) {
    const TemporaryFolder folder;
    anatomy::write_anatomy(test::iliac_renal(), folder.path(), {});
    change(folder / "iliac-renal.stl");
    std::string toml = read(asset("scenarios/renal.toml"));
    const std::string grown = "[anatomy]\npreset = \"iliac-renal\"\n";
    toml.erase(toml.find(grown), grown.size());
    write(folder / "x.toml", "anatomy = \"iliac-renal.anatomy.json\"\n" + toml);
    expect_refused(
        run(folder, {"run", folder / "x.toml", "--commands", good_script, "--out", folder / "out"}), folder,
        expected);
}

}  // namespace

using BadInput = test::InFolder;

TEST_F(BadInput, UnknownScenarioIsRefusedWithThoseThatShip) {
    expect_refused(run(folder, {"run", "s_bent", "--commands", good_script, "--out", folder / "out"}), folder,
                   "is 's_bend' meant?");
}

TEST_F(BadInput, MissingCommandFileIsNamed) {
    expect_refused(run(folder, s_bend_run(folder / "out", {}, folder / "no.gw")), folder,
                   "no.gw: no such command file");
}

TEST_F(BadInput, UnknownCommand) {
    expect_script_refused("0 beam on\n3 push 5 mm\n", "x.gw:2:3: unknown command 'push'");
}
TEST_F(BadInput, WrongUnit) {
    expect_script_refused("3 advance 5 cm\n", "x.gw:1:13: 'cm' was found; the unit 'mm'");
}
TEST_F(BadInput, FramesOutOfOrder) {
    expect_script_refused("9 beam on\n3 beam off\n", "x.gw:2:1: '3' was found");
}
TEST_F(BadInput, NotANumber) {
    expect_script_refused("3 advance nan mm\n", "x.gw:1:11: 'nan' was found");
}
TEST_F(BadInput, AbsurdAmount) {
    expect_script_refused("3 advance 1e9 mm\n", "a number from 0 to 500 is accepted");
}
TEST_F(BadInput, ArmThatCannotBe) {
    expect_script_refused("3 arm sid 500 mm sod 1500 mm\n", "x.gw:1:3");
}

TEST_F(BadInput, InjectionIntoNoBranch) {
    expect_script_refused("3 inject 5 ml at 5 ml/s into nowhere\n",
                          "x.gw:1:3: contrast cannot go into 'nowhere'");
}
TEST_F(BadInput, ContrastBeyondTheLimit) {
    expect_script_refused("3 inject 200 ml at 20 ml/s into tube\n9 inject 150 ml at 20 ml/s into tube\n",
                          "x.gw:2:3: 150 ml");
}
TEST_F(BadInput, MorePulsesThanFrames) {
    expect_script_refused("3 pulse 30 per second\n", "x.gw:1:3: 30 pulses per second were asked for");
}
TEST_F(BadInput, ImageOfNoSizeOrAHugeOne) {
    for (const char* pixels : {"pixels = 0", "pixels = 100000"})
        expect_scenario_refused("s_bend.toml", "pixels = 256", pixels,
                                "a whole number from 32 to 2048 is accepted");
}
TEST_F(BadInput, SourceBehindTheDetector) {
    expect_scenario_refused("s_bend.toml", "sid_mm = 1100.0", "sid_mm = 700.0",
                            "the isocentre must lie between source and detector");
}

TEST_F(BadInput, UnknownKey) {
    expect_scenario_refused("s_bend.toml", "inserted_mm", "insertd_mm",
                            ": unknown key 'insertd_mm' in [entry]");
}

TEST_F(BadInput, MissingMesh) {
    expect_mesh_refused([](const auto& stl) { std::filesystem::remove(stl); },
                        "iliac-renal.stl: no such mesh can be read");
}

TEST_F(BadInput, UnreadableMesh) {
    expect_mesh_refused([](const auto& stl) { write(stl, "not a mesh at all"); },
                        "iliac-renal.stl: 17 bytes were found where");
}

TEST_F(BadInput, MeshOpenWhereNoEndIs) {
    // A binary STL is 80 bytes, a count, and 50 bytes a triangle: one lies twice, another is gone.
    expect_mesh_refused(
        [](const auto& stl) {
            std::string bytes = read(stl);
            bytes.replace(84 + 50 * 30'000, 50, bytes.substr(84, 50));
            write(stl, bytes);
        },
        "the mesh is open at");
}

TEST_F(BadInput, WireThickerThanTheVesselAtItsEntry) {
    expect_scenario_refused("renal.toml",
                            "end = \"aorta+LCIA+LEIA+LCFA.out\"\ninserted_mm = 80.0\n\n[guidewire]",
                            "end = \"LIIA.out\"\ninserted_mm = 35.0\n\n[guidewire]\ndiameter_mm = 4.2",
                            "does not enter at 'LIIA.out'");
}

TEST_F(BadInput, TargetOutsideTheAnatomy) {
    expect_scenario_refused("s_bend.toml", "name = \"end\"", "centre_mm = [0.0, 0.0, 500.0]",
                            "the target is outside the anatomy");
}

TEST_F(BadInput, OutputFolderThatCannotBeMade) {
    write(folder / "file", "");
    const auto result = run(folder, s_bend_run(folder / "file/out"));
    expect_refused(result, folder, "file/out: cannot be written: the output folder cannot be made");
    EXPECT_EQ(read(folder / "file"), "");
}

TEST_F(BadInput, OutputFolderThatCannotBeWrittenTo) {
    std::filesystem::create_directory(folder / "parent");
    std::filesystem::create_symlink("/proc", folder / "parent/proc");  // refuses even the superuser
    const auto result = run(folder, s_bend_run(folder / "parent/proc/out"));
    EXPECT_EQ(result.code, 2) << result.error;
    test::expect_said(result.error, "cannot be made");
}

TEST_F(BadInput, FullDiskIsToldAndLeavesOnlyWholeFiles) {
    // A file may grow to one block of 1024 bytes: the recording and score fit, an image does not.
    const std::string limited = "ulimit -f 1; exec \"$0\" \"$@\"";
    std::vector<std::string> words = {"bash", "-c", limited};
    for (const std::string& word : test::command(s_bend_run(folder / "out"))) {
        words.push_back(word);
    }
    const Outcome result = test::Started(folder, words).wait();
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
    std::vector<std::string> words = {"bash", "-c", "ulimit -f 40; exec \"$0\" \"$@\""};
    for (const std::string& word :
         test::command(s_bend_run(folder / "out", {"--set", "c_arm.pixels=64", "--dicom", "signal"})))
        words.push_back(word);
    const Outcome result = test::Started(folder, words).wait();
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

TEST_F(BadInput, ExpectationThatIsNotThere) {
    expect_refused(run(folder, s_bend_run(folder / "out", {"--expect", folder / "none"})), folder,
                   "none: no such command file");
}

TEST_F(BadInput, WrongArgumentsAreExitCodeTwo) {
    EXPECT_EQ(run(folder, {}).code, 2);
    EXPECT_EQ(run(folder, {"fly"}).code, 2);
    EXPECT_EQ(run(folder, {"run", "s_bend"}).code, 2);
    EXPECT_EQ(run(folder, s_bend_run(folder / "out", {"--every", "0"})).code, 2);
}

}  // namespace app
