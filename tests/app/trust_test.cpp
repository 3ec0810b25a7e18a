/// Nothing is done before what cannot end well is refused, nothing waits for ever, and two programs do not
/// mix their files.

#include <algorithm>
#include <csignal>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <thread>

#include "engine/anatomy/anatomy_writer.h"
#include "tests/anatomies.h"
#include "tests/app/program.h"

namespace app {
namespace {

using test::asset, test::good_script, test::joined, test::Outcome, test::read, test::run, test::s_bend_run,
    test::Started, test::TemporaryFolder, test::write;
using Words = std::vector<std::string>;

/// Runs the program below `folder`: its cache and its home are there too, and whoever waits is ended.
Outcome at_home(const TemporaryFolder& folder, const Words& words) {
    const std::string home = folder / "home";
    const Words before = {"env",
                          "-u",
                          "DISPLAY",
                          "HOME=" + folder.path().string(),
                          "XDG_CACHE_HOME=" + home,
                          "XDG_DATA_HOME=" + home,
                          "timeout",
                          "-k",
                          "1",
                          "120"};
    return Started(folder, joined(before, test::command(words))).wait();
}

/// Every file below the folder, but what the test itself has redirected.
Words files_below(const std::filesystem::path& folder) {
    Words names;
    std::error_code none;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, none))
        if (const std::string name = entry.path().filename(); name != "stdout.txt" && name != "stderr.txt")
            names.push_back(entry.path().string());
    std::sort(names.begin(), names.end());
    return names;
}

/// Files and words for commands that would have to grow vessels.
struct Trust : testing::Test {
    const TemporaryFolder folder;
    std::string script = asset("scripts/renal.gw").string(), recording, list;
    Trust() {
        std::filesystem::create_directory(folder / "recordings");
        recording = (folder / "recordings/a.gw").string();
        // As a run records them, with nothing stated of states and anatomy.
        write(recording,
              "recording 3\nprogram 0000000000000000 seldinger\nscenario 0000000000000000 renal\n"
              "anatomy 0000000000000000\n5 end\n");
        list = (folder / "list.toml").string();
        write(list, "schema = 1\n[[run]]\nscenario = \"renal\"\ncommands = \"solution\"\nimages = false\n");
        write(folder / "file", "kept");
    }
    /// Asserts a refusal that says `expected` and left the folder as it was: no vessels and no field were
    /// made.
    void expect_refused_at_once(const Words& words, const std::string& expected) const {
        std::string all;
        for (const std::string& word : words) all += " " + word;
        SCOPED_TRACE(all);
        const Words before = files_below(folder.path());
        expect_refused(at_home(folder, words), expected);
        EXPECT_EQ(files_below(folder.path()), before);
    }
};

}  // namespace

TEST_F(Trust, OutputsThatCannotBeWrittenAreRefusedBeforeVesselsAreMade) {
    const Words run = {"run", "renal", "--commands", script}, render = {"render", "renal"},
                show = {"show", "renal"};
    for (const std::string& bad : {std::string("/proc/nope"), (folder / "file").string()}) {
        const std::string below = bad + "/x";
        expect_refused_at_once(joined(run, {"--out", bad}), "cannot be written");
        expect_refused_at_once(joined(run, {"--out", below}),
                               "x: cannot be written: the output folder cannot be made");
        expect_refused_at_once(joined(run, {"--out", folder / "out", "--frames", "none", "--trace", below}),
                               "x: cannot be written");
        expect_refused_at_once(joined(render, {"--out", below + ".png"}), "cannot be written");
        expect_refused_at_once(joined(show, {"--out", below + ".png"}), "cannot be written");
        expect_refused_at_once({"batch", list, "--out", bad}, "cannot be written");
        expect_refused_at_once({"course", folder / "recordings", "--out", bad}, "cannot be written");
        expect_refused_at_once({"debrief", recording, "--out", bad}, "cannot be written");
        expect_refused_at_once({"score", recording, "--out", below}, "cannot be written");
        expect_refused_at_once({"anatomy", "generate", "iliac-renal", "--out", bad}, "cannot be written");
        expect_refused_at_once({"anatomy", "voxelise", "renal", "--out", below + ".nii"},
                               "cannot be written");
        expect_refused_at_once({"study", "accuracy", "--quick", "--out", bad}, "cannot be written");
        expect_refused_at_once({"device", "show", "rosen035", "--out", below + ".png"}, "cannot be written");
    }
    EXPECT_EQ(read(folder / "file"), "kept");
}

TEST_F(Trust, AFileInThePlaceOfAPartOfTheOutputIsRefusedBeforeVesselsAreMade) {
    std::filesystem::create_directory(folder / "out");
    write(folder / "out/frames", "mine");
    expect_refused_at_once({"run", "renal", "--commands", script, "--out", folder / "out"},
                           "out/frames: cannot be written");
    std::filesystem::create_directories(folder / "page/debrief.html");
    expect_refused_at_once({"debrief", recording, "--out", folder / "page"},
                           "debrief.html: cannot be written");
    std::filesystem::create_directories(folder / "two/score.json");
    expect_refused_at_once(
        {"run", "renal", "--commands", script, "--out", folder / "two", "--frames", "none"},
        "score.json: cannot be written: a folder is in its place");
}

TEST_F(Trust, WrongCommandsAndOptionsAreRefusedBeforeVesselsAreMade) {
    const Words run = {"run", "renal", "--out", folder / "out", "--commands"},
                render = {"render", "renal", "--out", folder / "x.png"},
                show = {"show", "renal", "--out", folder / "x.png"};
    write(folder / "wrong.gw", "3 fly 5 mm\n");
    write(folder / "catheter.gw", "3 advance catheter 5 mm\n");
    for (const char* name : {"none.gw", "wrong.gw", "catheter.gw"}) {
        const std::string file = folder / name;
        expect_refused_at_once(joined(run, {file}), file);
        expect_refused_at_once(joined(render, {"--commands", file}), file);
        expect_refused_at_once(joined(show, {"--commands", file}), file);
        expect_refused_at_once({"debrief", recording, file, "--out", folder / "out"}, file);
    }
    const Words good = joined(run, {script});
    expect_refused_at_once(joined(good, {"--set", "guidewire.friction"}), "KEY=VALUE");
    expect_refused_at_once(joined(good, {"--set", "guidewire.frction=1"}), "frction");
    expect_refused_at_once(joined(good, {"--frames", "none", "--panel"}), "--panel needs images");
    expect_refused_at_once(joined(good, {"--expect", folder / "none"}), "none: no such");
    expect_refused_at_once(joined(good, {"--learner", "a\nb"}), "--learner");
    expect_refused_at_once(joined(render, {"--lao", "500"}), "LAO/RAO angle");
    expect_refused_at_once(joined(render, {"--frame", "999999"}), "0 to");
    expect_refused_at_once({"render", "renal", "--out", folder / "x.jpg"}, ".png");
    expect_refused_at_once({"show", "renal", "--out", folder / "x.jpg"}, ".png");
    expect_refused_at_once({"anatomy", "voxelise", "renal", "--out", folder / "x.txt"}, ".nrrd");
    expect_refused_at_once({"score", script}, "does not say which scenario");
    expect_refused_at_once({"list", "renall"}, "no such scenario");
}

TEST_F(Trust, InjectionIntoNoBranchIsRefusedBeforeTheFieldIsMade) {
    write(folder / "x.gw", "3 inject 5 ml at 5 ml/s into nowhere\n");
    expect_refused(
        at_home(folder, s_bend_run(folder / "out",
                                   {"--cache", folder / "cache", "--set", "wall.model=\"distance-field\""},
                                   folder / "x.gw")),
        "contrast cannot go into 'nowhere'");
    EXPECT_EQ(files_below(folder / "cache"), Words());
}

TEST_F(Trust, ARecordingOfAnotherScenarioIsRefusedBeforeVesselsAreMade) {
    std::string text = read(recording);
    write(recording, text.replace(text.find("0000000000000000 renal"), 16, "0123456789abcdef"));
    expect_refused_at_once({"score", recording}, "has changed since it was recorded");
    expect_refused_at_once({"replay", recording}, "has changed since it was recorded");
}

TEST_F(Trust, FifosAndDevicesAreRefusedByEveryReader) {
    const auto fifo = [&](const std::string& name) {
        const std::filesystem::path path = folder / name;
        EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
        return path.string();
    };
    const std::string gw = fifo("x.gw"), toml = fifo("x.toml"), csv = fifo("x.csv"), json = fifo("x.json"),
                      stl = fifo("x.stl"), vtp = fifo("x.vtp"), nii = fifo("x.nii"), obj = fifo("x.obj"),
                      out = folder / "out", png = folder / "x.png", real = folder / "iliac-renal.stl";
    anatomy::write_anatomy(test::iliac_renal(), folder.path(), {});
    std::string scenario = read(asset("scenarios/renal.toml"));
    const std::string grown = "[anatomy]\npreset = \"iliac-renal\"\n";
    scenario.erase(scenario.find(grown), grown.size());
    write(folder / "named.toml", "anatomy = \"x.json\"\n" + scenario);
    std::string body = test::small_toml;
    body.replace(body.find("patient = false"), 15, "[patient]\nct = \"x.nii\"");
    write(folder / "ct.toml", body);
    const std::string is_fifo = " is a FIFO; expected a regular file";
    for (const Words& words :
         std::vector<Words>{{"run", toml, "--commands", script, "--out", out},
                            s_bend_run(out, {}, gw),
                            s_bend_run(out, {"--expect", gw}),
                            {"run", folder / "named.toml", "--commands", script, "--out", out},
                            {"run", folder / "ct.toml", "--commands", good_script, "--out", out},
                            {"render", toml, "--out", png},
                            {"render", "s_bend", "--commands", gw, "--out", png},
                            {"show", toml, "--out", png},
                            {"list", toml},
                            {"score", gw},
                            {"replay", gw},
                            {"debrief", gw, "--out", out},
                            {"debrief", recording, "--expert", gw, "--out", out},
                            {"batch", toml, "--out", out},
                            {"device", "show", toml},
                            {"relax", "--tube", csv, "--radius", "3", "--segments", "9", "--segment-length",
                             "1", "--rigidity", "5", "--wall-stiffness", "1", "--method", "global", "--out",
                             folder / "joints.csv", "--report", folder / "report.json"},
                            {"anatomy", "generate", toml, "--out", out},
                            {"anatomy", "import", stl, "--unit", "mm", "--out", out},
                            {"anatomy", "import", obj, "--unit", "mm", "--out", out},
                            {"anatomy", "import", vtp, "--unit", "mm", "--out", out},
                            {"anatomy", "import", real, "--unit", "mm", "--centrelines", csv, "--out", out},
                            {"anatomy", "check", json},
                            {"anatomy", "show", json, "--out", png}})
        expect_refused_at_once(words, is_fifo);
    for (const Words& words : std::vector<Words>{{"run", "/dev/zero", "--commands", script, "--out", out},
                                                 {"score", "/dev/zero"},
                                                 {"anatomy", "check", "/dev/zero"}})
        expect_refused_at_once(words, "/dev/zero: is a device; expected a regular file");
}

TEST_F(Trust, NumbersThatAreNotFiniteAreRefused) {
    const std::string out = folder / "out";
    for (const char* number : {"nan", "inf", "-inf", "NAN"}) {
        const std::string three = std::string("1,2,") + number;
        expect_refused_at_once({"anatomy", "import", "x.stl", "--out", out, "--inlet", three},
                               "--inlet: expected a number, found '" + std::string(number) + "'");
        expect_refused_at_once(
            {"anatomy", "import", "x.stl", "--out", out, "--body", "pelvis", "--landmark", three},
            "--landmark: ");
        expect_refused_at_once({"anatomy", "import", "x.stl", "--out", out, "--end", three}, "--end: ");
    }
    expect_refused_at_once({"render", "renal", "--out", folder / "x.png", "--lao", "nan"},
                           "--lao: expected a number, found 'nan'");
}

TEST_F(Trust, NamesThatAreFoldersAreRefused) {
    for (const char* name : {".", "..", "a/b", "/tmp/x"})
        expect_refused_at_once(
            {"anatomy", "generate", "iliac-renal", "--name", name, "--out", folder / "out"},
            "expected a file name without a folder");
}

TEST_F(Trust, FullStandardOutputIsToldWithExitCodeTwo) {
    for (const char* words : {"list", "list devices", "list s_bend", "--help", "--version", "run --help",
                              "study", "study --help", "device show rosen035"}) {
        const Outcome result =
            Started(folder,
                    {"bash", "-c", "exec \"$0\" " + std::string(words) + " > /dev/full", SELDINGER_PROGRAM})
                .wait();
        EXPECT_EQ(result.code, 2) << words << result.error;
        EXPECT_NE(result.error.find("No space left on device"), std::string::npos) << words << result.error;
    }
}

TEST_F(Trust, ClosedStandardErrorDoesNotEndARun) {
    const Outcome result =
        Started(folder,
                {"bash", "-c", "exec \"$0\" run s_bend --commands \"$1\" --out \"$2\" --frames none 2>&-",
                 SELDINGER_PROGRAM, good_script, folder / "out"})
            .wait();
    EXPECT_EQ(result.code, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "out/score.json"));
}

/// Writes to the pipe that a program takes for its standard input, and returns it when all has been read.
int typed_into(const std::filesystem::path& pipe, const std::string& text) {
    const int typed = open(pipe.c_str(), O_WRONLY);  // when the program has opened it
    EXPECT_EQ(::write(typed, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    for (int left = 1; left > 0;) {
        EXPECT_EQ(ioctl(typed, FIONREAD, &left), 0);
        pollfd reader{typed, 0, 0};
        ::poll(&reader, 1, 1);
        if ((reader.revents & POLLERR) != 0) {
            ADD_FAILURE() << "the program has ended and left " << left << " bytes unread";
            break;
        }
    }
    return typed;
}

TEST_F(Trust, NoFileTakesTheNumberOfAClosedStream) {
    // Otherwise progress and notes would be written into a recording.
    ASSERT_EQ(mkfifo((folder / "typed").c_str(), 0600), 0);
    const Started program(folder, {"bash", "-c",
                                   "exec \"$0\" run s_bend --commands - --out \"$1\" --frames none <\"$2\" "
                                   ">&- 2>&-",
                                   SELDINGER_PROGRAM, folder / "out", folder / "typed"});
    const int typed = typed_into(folder / "typed", "0..10 advance 1 mm\n");
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
        EXPECT_EQ(std::filesystem::read_symlink("/proc/" + std::to_string(program.process()) + "/fd/" +
                                                std::to_string(stream)),
                  "/dev/null");
    ASSERT_EQ(::write(typed, "12 end\n", 7), 7);
    close(typed);
    EXPECT_EQ(program.wait().code, 2);  // its summary cannot be written
    EXPECT_EQ(run(folder, {"replay", folder / "out/run.gw"}).code, 0);
}

TEST_F(Trust, ASignalWhileAScriptIsTypedKeepsTheEarlierRun) {
    const std::vector<std::string> words = s_bend_run(folder / "out", {"--frames", "none"});
    ASSERT_LE(run(folder, words).code, 1);
    const std::string before = read(folder / "out/run.gw");
    ASSERT_EQ(mkfifo((folder / "typed").c_str(), 0600), 0);
    for (const std::string line : {"0 beam on\n1..3 advance 2 mm\n", "0 beam on\n1..3 adva"}) {
        const Started program(
            folder, {"bash", "-c", "exec \"$0\" run s_bend --commands - --out \"$1\" --frames none <\"$2\"",
                     SELDINGER_PROGRAM, folder / "out", folder / "typed"});
        // The program catches signals before it reads.
        const int typed = typed_into(folder / "typed", line);
        program.signal(SIGINT);
        EXPECT_EQ(program.wait().code, 130) << line;
        close(typed);
        EXPECT_EQ(read(folder / "out/run.gw"), before);
    }
}

TEST_F(Trust, WholeNumbersAreDecimal) {
    for (const std::string number : {"010", "0x10"})
        expect_refused(run(folder, s_bend_run(folder / "out", {"--every=" + number})),
                       "found '" + number + "'");
    expect_refused(
        run(folder, {"anatomy", "generate", "lca", "--seed", "007", "--out", folder / "out"}),
        "--seed: expected a whole number from 0 to 9000000000000000 without leading zeros, found '007'");
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

/// Nothing that was said does anything to the terminal.
bool plain(const Outcome& result) {
    return std::ranges::none_of(result.out + result.error, [](char byte) {
        return (byte >= 0 && byte < 0x20 && byte != '\n') || byte == 0x7f;
    });
}

TEST_F(Trust, OptionsAreQuotedWithoutControlCharacters) {
    const std::string wild = "all\x1b[2J\a";
    for (const char* option :
         {"--every", "--frames", "--dicom", "--learner", "--expect", "--trace", "--cache"}) {
        const Outcome result = run(folder, s_bend_run(folder / "out", {option, wild}));
        ASSERT_TRUE(plain(result)) << option << result.error;
    }
}

/// What a stranger's file says is shown, and does nothing to the terminal.
TEST_F(Trust, TextOfFilesIsPrintedWithoutControlCharacters) {
    std::string toml = read(asset("scenarios/s_bend.toml"));
    const std::size_t title = toml.find("title = \"") + 9;
    toml.insert(title, "a\\u001b[2Jb\\u0007\\u009b1m");
    const std::filesystem::path scenario = folder / "e\x1b[2Jsc\a.toml";
    write(scenario, toml);
    const Outcome listed = succeeded(folder, {"list", scenario});
    test::expect_said(listed.out, "a?[2Jb?");
    EXPECT_TRUE(plain(listed));
    const Outcome made = run(folder, {"run", scenario, "--commands", good_script, "--out",
                                      folder / "o\x1b[2Jut", "--frames", "none"});
    EXPECT_LE(made.code, 1) << made.error;
    EXPECT_TRUE(plain(made)) << made.out;
    for (const char* command : {"score", "replay"}) {
        const Outcome read_again =
            run(folder, {command, folder / "o\x1b[2Jut/run.gw", "--scenario", scenario});
        EXPECT_LE(read_again.code, 1) << read_again.error;
        EXPECT_TRUE(plain(read_again)) << read_again.out;
    }
    std::string device = read(asset("devices/rosen035.toml"));
    device.insert(device.find("title = \"") + 9, "x\\u001b[2J\\u0007");
    write(folder / "dev.toml", device);
    const Outcome shown = succeeded(folder, {"device", "show", folder / "dev.toml"});
    test::expect_said(shown.out, "x?[2J?");
    EXPECT_TRUE(plain(shown));
}

TEST_F(Trust, AValueInPlaceOfTheFilesHasNoLineOfTheFile) {
    const Outcome result = run(folder, s_bend_run(folder / "out", {"--set", "guidewire.diameter_mm=30.0"}));
    expect_refused(result, "guidewire.diameter_mm = 30.0");
    EXPECT_EQ(result.error.find(".toml:1"), std::string::npos) << result.error;
}

TEST_F(Trust, HelpSpeaksOfItsOwnCommand) {
    for (const std::string name : {"list", "show", "study"}) {
        const Outcome help = run(folder, {name, "--help"});
        EXPECT_EQ(help.code, 0);
        test::expect_said(help.out, "Usage: seldinger " + name);
        test::expect_said(help.out, "Examples:\n  seldinger " + name);
        test::expect_said(help.out, "Exit codes");
        for (const std::string other : {"run", "list", "show", "study", "render", "batch"})
            if (other != name) {
                EXPECT_EQ(help.out.find("seldinger " + other), std::string::npos) << help.out;
            }
    }
}

TEST_F(Trust, TheSecondRunIntoAFolderIsRefusedAtOnceAndTheFirstGoesOn) {
    const TemporaryFolder other;
    const Started first = test::endless_run(folder, "out", 10);
    const std::string before = read(folder / "out/run.gw");
    expect_refused(run(other, s_bend_run(folder / "out", {"--frames", "none"})),
                   "process " + std::to_string(first.process()) + " is writing to this folder");
    EXPECT_TRUE(read(folder / "out/run.gw").starts_with(before));
    // A batch, a course and a page into it are refused too.
    write(folder / "list.toml",
          "schema = 1\n[[run]]\nscenario = \"s_bend\"\ncommands = \"solution\"\nimages = false\n");
    EXPECT_EQ(run(other, {"batch", folder / "list.toml", "--out", folder / "out"}).code, 2);
    EXPECT_EQ(run(other, {"course", folder / "out"}).code, 2);
    first.signal(SIGTERM);
    EXPECT_EQ(first.wait().code, 130);
    EXPECT_FALSE(std::filesystem::exists(folder / "out/.seldinger.lock"));
}

TEST_F(Trust, AKilledRunLocksNobodyOut) {
    const Started first = test::endless_run(folder, "out", 10);
    first.signal(SIGKILL);
    first.wait();
    succeeded(folder, s_bend_run(folder / "out", {"--frames", "none"}));
    EXPECT_EQ(test::names_in(folder / "out"), (Words{"run.gw", "score.json"}));
}

TEST_F(Trust, NoOutputReplacesAnInputOrAnotherOutput) {
    write(folder / "tree.toml",
          "schema = 1\n[[branch]]\nname = \"v\"\npoints_mm = [[0, 0, 0, 3], [0, 0, 80, 3]]\n");
    write(folder / "own.toml",
          "schema = 1\ntitle = \"own\"\n[anatomy]\ntree = \"tree.toml\"\n[entry]\nend = \"v.in\"\n"
          "inserted_mm = 40.0\n[target]\ncentre_mm = [0, 0, 60]\n");
    const std::filesystem::path box = folder / "box.stl", scene = folder / "mesh.toml";
    write(box, "solid box\nendsolid\n");
    write(scene, read(folder / "own.toml") +
                     "[patient]\n[[patient.mesh]]\nfile = \"box.stl\"\nmaterial = \"cortical bone\"\n");
    write(folder / "own.gw", "0 beam on\n1 advance 2 mm\n3 end\n");
    std::filesystem::create_directory(folder / "out");
    write(folder / "out/run.gw", "an earlier run's");
    for (const char* name : {"png", "nii"})
        std::filesystem::create_symlink("own.toml", folder / (std::string("link.") + name));
    const std::string own = folder / "own.toml", own_script = folder / "own.gw";
    const Words run = {"run",          own,        "--commands", own_script, "--out",
                       folder / "out", "--frames", "none",       "--trace"},
                score = {"score", recording, "--out"}, all[] = {run, score};
    const auto refused = [&](const Words& words, const std::string& expected) {
        const std::string before = read(own) + read(folder / "tree.toml") + read(own_script) +
                                   read(recording) + read(folder / "out/run.gw") + read(box);
        expect_refused_at_once(words, expected);
        EXPECT_EQ(read(own) + read(folder / "tree.toml") + read(own_script) + read(recording) +
                      read(folder / "out/run.gw") + read(box),
                  before);
    };
    const std::string input = "would overwrite what is read";
    refused(joined(run, {own}), input);
    refused(joined(run, {folder / "tree.toml"}), input);
    refused(joined(run, {own_script}), input);
    refused(joined(run, {folder / "link.png"}), input);
    refused(joined(run, {folder / "out/../own.toml"}), input);
    for (const char* name : {"run.gw", "score.json", "sheet.png", "../out/score.json"})
        refused(joined(run, {folder / "out" / name}), "would be written twice");
    refused(joined(run, {folder / "out/frames/frame_000001.png"}), "a file of the run's own");
    refused({"run", scene, "--commands", own_script, "--out", folder / "out", "--trace", box}, input);
    refused(joined(score, {recording}), input);
    refused({"score", recording, "--scenario", own, "--out", own}, input);
    refused({"score", recording, "--scenario", own, "--out", folder / "tree.toml"}, input);
    refused({"render", own, "--out", folder / "link.png"}, input);
    refused({"show", own, "--out", folder / "link.png"}, input);
    refused({"anatomy", "voxelise", own, "--out", folder / "link.nii"}, input);
    std::filesystem::create_directory(folder / "page");
    std::filesystem::create_symlink("../own.toml", folder / "page/debrief.html");
    refused({"debrief", recording, "--scenario", own, "--force", "--out", folder / "page"}, input);
    std::filesystem::create_symlink("../recordings/a.gw", folder / "page/course.csv");
    refused({"course", folder / "recordings", "--out", folder / "page"}, input);
}

/// A scenario with vessels that are grown in a moment, and a script.
struct Grown {
    TemporaryFolder folder;
    std::string file = folder / "own.toml", script = folder / "own.gw";
    Grown() {
        write(file,
              "schema = 1\ntitle = \"own\"\n[anatomy]\n[[anatomy.branch]]\nname = \"v\"\n"
              "points_mm = [[0, 0, 0, 3], [0, 0, 80, 3]]\n[entry]\nend = \"v.in\"\ninserted_mm = 40.0\n"
              "[target]\ncentre_mm = [0, 0, 60]\n");
        write(script, "0 beam on\n1..5 advance 2 mm\n8 end\n");
    }
    Words words(const std::string& out, const std::string& cache) const {
        return {"run",        file,       "--commands", script,    "--out",
                folder / out, "--frames", "none",       "--cache", cache};
    }
};

TEST_F(Trust, AFullCacheIsNotedAndDoneWithout) {
    const Grown grown;
    const Outcome whole = at_home(grown.folder, grown.words("whole", grown.folder / "cache"));
    ASSERT_LT(whole.code, 2) << whole.error;
    // A file may grow to 64 blocks of 1024 bytes: all of the run's files do, vessels and fields are larger.
    const auto limited = [&](const Words& words) {
        return test::run_with_small_files(64, grown.folder, words);
    };
    const Outcome full = limited(grown.words("full", grown.folder / "small"));
    EXPECT_EQ(full.code, whole.code) << full.error;
    const std::string note = "what was made cannot be kept, and is made again next time";
    test::expect_said(full.error, note);
    EXPECT_EQ(full.error.find(note, full.error.find(note) + 1), std::string::npos) << full.error;
    EXPECT_EQ(read(grown.folder / "full/run.gw"), read(grown.folder / "whole/run.gw"));
    EXPECT_EQ(files_below(grown.folder / "small"), Words());
    const Outcome baked = limited({"bake", "rca", "--seeds", "0:1", "--cache", grown.folder / "small"});
    EXPECT_EQ(baked.code, 1) << baked.error;
    test::expect_said(baked.out, "0 of 1 anatomies are in");
    test::expect_said(baked.out, "1 cannot be kept");
}

TEST_F(Trust, WithoutCacheAndTemporaryFolderVesselsAreGrownAndOthersAreTold) {
    const Grown grown;
    const auto without = [&](const Words& words) {
        return Started(grown.folder, joined({"env", "TMPDIR=/nonexistent"}, test::command(words))).wait();
    };
    const Outcome made = without(grown.words("out", "/dev/null/x"));
    EXPECT_LT(made.code, 2) << made.error;
    test::expect_said(made.error, "/dev/null/x: what was made cannot be kept");
    test::expect_said(made.error, "Not a directory");
    expect_refused(
        without({"show", "s_bend", "--cache", grown.folder / "cache", "--out", grown.folder / "x.png"}),
        "/nonexistent: a folder for temporary files cannot be made");
}

TEST_F(Trust, AFifoInTheCacheIsReplaced) {
    const Grown grown;
    const std::filesystem::path cache = grown.folder / "cache";
    const Outcome first = at_home(grown.folder, grown.words("out", cache));
    ASSERT_LT(first.code, 2) << first.error;
    std::filesystem::path field;
    for (const auto& entry : std::filesystem::directory_iterator(cache))
        if (entry.path().filename().string().starts_with("field-")) field = entry.path();
    ASSERT_FALSE(field.empty());
    const std::string bytes = read(field);
    const auto again = [&] {
        EXPECT_EQ(at_home(grown.folder, grown.words("out", cache)).code, first.code);
        EXPECT_EQ(read(field), bytes);
        EXPECT_TRUE(std::filesystem::is_regular_file(std::filesystem::symlink_status(field)));
    };
    std::filesystem::remove(field);
    ASSERT_EQ(::mkfifo(field.c_str(), 0600), 0);
    const Outcome listed = at_home(grown.folder, {"cache", "list", "--cache", cache});
    EXPECT_EQ(listed.out.find("18446744073709"), std::string::npos) << listed.out;
    again();
    std::filesystem::remove(field);
    std::filesystem::create_symlink("/dev/null", field);
    again();
}

TEST_F(Trust, AnAmountToKeepThatIsNoneIsRefusedAndNothingIsRemoved) {
    std::filesystem::create_directory(folder / "cache");
    write(folder / "cache/field-1.bin", "kept");
    for (const char* amount : {"1e308", "1e14", "-1e-9", "-1", "nan"}) {
        const Outcome result =
            run(folder, {"cache", "clear", "--cache", folder / "cache", std::string("--keep-mb=") + amount});
        EXPECT_EQ(result.code, 2) << amount;
        EXPECT_TRUE(std::filesystem::exists(folder / "cache/field-1.bin")) << amount;
    }
    EXPECT_EQ(run(folder, {"cache", "clear", "--cache", folder / "cache", "--keep-mb=1e9"}).code, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "cache/field-1.bin"));
    EXPECT_EQ(run(folder, {"cache", "clear", "--cache", folder / "cache"}).code, 0);
    EXPECT_FALSE(std::filesystem::exists(folder / "cache/field-1.bin"));
}

TEST_F(Trust, WhatIsOfACtIsListedAndRemovedAlone) {
    const std::string cache = folder / "cache";
    std::filesystem::create_directory(cache);
    std::filesystem::permissions(cache, std::filesystem::perms::all);
    write(folder / "cache/field-1.bin", "kept");
    write(folder / "cache/ct-1.bin", "voxels");
    const Outcome listed = run(folder, {"cache", "list", "--cache", cache});
    expect_said(listed.out, "ct-1.bin  of a CT\n");
    expect_said(listed.out, "field-1.bin\n");
    expect_said(listed.out, "; 1 of a CT, which 'clear --ct' removes");
    expect_said(listed.out, "Others may enter this folder");
    expect_refused(run(folder, {"cache", "clear", "--cache", cache, "--ct", "--keep-mb=1"}), "--keep-mb");
    expect_said(run(folder, {"cache", "clear", "--cache", cache, "--ct"}).out, "1 things removed");
    EXPECT_EQ(test::names_in(cache), std::vector<std::string>{"field-1.bin"});
    std::filesystem::permissions(cache, std::filesystem::perms::owner_all);
    const Outcome again = run(folder, {"cache", "list", "--cache", cache});
    EXPECT_EQ(again.out.find("Others"), std::string::npos) << again.out;
    EXPECT_EQ(again.out.find("CT"), std::string::npos) << again.out;
}

TEST_F(Trust, WhatCannotBeRemovedFromACacheIsCounted) {
    if (::geteuid() == 0 && std::system("unshare -m true 2> /dev/null") != 0)
        GTEST_SKIP() << "nothing here can be made read-only for this user";
    std::filesystem::create_directory(folder / "cache");
    write(folder / "cache/field-1.bin", "kept");
    const std::string cache = folder / "cache";
    // The superuser may write anywhere but to a file system that is mounted read-only.
    const std::string prepare = ::geteuid() == 0
                                    ? "mount --bind \"$1\" \"$1\" && mount -o remount,bind,ro \"$1\" && "
                                    : "chmod a-w \"$1\" && ";
    Words words = {"sh", "-c", prepare + "exec \"$0\" cache clear --cache \"$1\"", SELDINGER_PROGRAM, cache};
    if (::geteuid() == 0) words.insert(words.begin(), {"unshare", "-m"});
    const Outcome result = Started(folder, words).wait();
    std::filesystem::permissions(cache, std::filesystem::perms::owner_all);
    expect_refused(result, "1 things cannot be removed, field-1.bin first");
    EXPECT_TRUE(std::filesystem::exists(folder / "cache/field-1.bin"));
}

}  // namespace app
