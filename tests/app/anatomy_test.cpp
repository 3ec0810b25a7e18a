/// `seldinger anatomy`, run as a user runs it.

#include "tests/app/program.h"

namespace app {
namespace {

using test::Outcome, test::read, test::run, test::TemporaryFolder, test::write;

const char* const small_tree = R"(schema = 1
[[branch]]
name = "main"
points_mm = [[0, 0, 0, 2], [15, 0, 0, 2], [30, 0, 0, 2]]
)";

void expect_refused(const TemporaryFolder& folder, const std::vector<std::string>& words,
                    const std::string& expected) {
    const Outcome result = run(folder, test::joined({"anatomy", "generate"}, words));
    EXPECT_EQ(result.code, 2) << result.error;
    test::expect_said(result.error, expected);
    EXPECT_FALSE(std::filesystem::exists(folder / "out/x.stl"));
    EXPECT_FALSE(std::filesystem::exists(folder / "out/x.anatomy.json"));
}

}  // namespace

using AnatomyGenerate = test::InFolder;

TEST_F(AnatomyGenerate, WritesAnAnatomyOnceAndKeepsIt) {
    write(folder / "x.toml", small_tree);
    const std::vector<std::string> words = {"anatomy", "generate", folder / "x.toml", "--out",
                                            folder / "out"};
    const Outcome first = succeeded(folder, words);
    const std::string json = read(folder / "out/x.anatomy.json"), stl = read(folder / "out/x.stl");
    test::expect_said(json, "main.in");
    EXPECT_EQ(first.out.find("kept"), std::string::npos) << first.out;
    test::expect_said(run(folder, words).out, "kept as it was");

    std::filesystem::remove_all(folder / "out");
    run(folder, words);
    EXPECT_EQ(read(folder / "out/x.anatomy.json"), json);
    EXPECT_EQ(read(folder / "out/x.stl"), stl);

    write(folder / "out/x.stl", "damaged");
    EXPECT_EQ(run(folder, words).code, 0);
    EXPECT_EQ(read(folder / "out/x.stl"), stl);

    EXPECT_EQ(run(folder, test::joined(words, {"--stenosis", "main:15:8:50"})).out.find("kept"),
              std::string::npos);
    EXPECT_NE(read(folder / "out/x.stl"), stl);
}

TEST(AnatomyShow, DrawsAPictureOrSaysWhyNot) {
    if (std::system("gnuplot --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "gnuplot is not installed";
    const TemporaryFolder folder;
    write(folder / "x.toml", small_tree);
    run(folder, {"anatomy", "generate", folder / "x.toml", "--out", folder / "out"});
    const std::string anatomy = folder / "out/x.anatomy.json", picture = folder / "x.png";
    succeeded(folder, {"anatomy", "show", anatomy, "--out", picture});
    EXPECT_EQ(read(picture).substr(1, 3), "PNG");
    EXPECT_GT(read(picture).size(), 10'000u);
    for (const char* wrong : {"x.jpg", "none/x.png"})
        EXPECT_EQ(run(folder, {"anatomy", "show", anatomy, "--out", folder / wrong}).code, 2) << wrong;
    test::expect_said(run(folder, {"anatomy", "show", folder / "y.anatomy.json", "--out", picture}).error,
                      "no such anatomy");
}

TEST_F(AnatomyGenerate, SaysWhoThePatientIs) {
    const Outcome made = succeeded(folder, {"anatomy", "generate", "rca", "--sex", "f", "--age", "71",
                                            "--height", "158", "--weight", "61", "--out", folder / "out"});
    test::expect_said(made.out, "patient: woman of 71 years, 158 cm, 61 kg");
    test::expect_said(read(folder / "out/rca.anatomy.json"),
                      "\"patient\":\"woman of 71 years, 158 cm, 61 kg\"");
}

TEST_F(AnatomyGenerate, RefusesWhatIsWrongAndWritesNothing) {
    const std::string out = folder / "out";
    expect_refused(folder, {"iliac-rena", "--out", out},
                   "(did you mean 'iliac-renal'?); presets are: arch-1");
    expect_refused(folder, {folder / "x.toml", "--out", out}, "no such vessel tree can be read");
    write(folder / "x.toml", std::string(small_tree) + "radius = 3\n");
    expect_refused(folder, {folder / "x.toml", "--out", out}, "x.toml:5:");
    write(folder / "x.toml", small_tree);
    expect_refused(folder, {folder / "x.toml", "--out", out, "--stenosis", "mian:15:8:50"},
                   "(did you mean 'main'?)");
    expect_refused(folder, {folder / "x.toml", "--out", out, "--stenosis", "main:35:8:50"},
                   "expected 0 to 30.0 mm");
    expect_refused(folder, {folder / "x.toml", "--out", out, "--name", "a/b"},
                   "a file name without a folder");
    expect_refused(folder, {"rca", "--out", out, "--sex", "x"}, "--sex: expected f or m, found 'x'");
    expect_refused(folder, {"rca", "--out", out, "--age", "7"}, "--age");
    expect_refused(folder, {folder / "x.toml", "--out", out, "--sex", "f"},
                   "expected a preset whose patient they describe");
    write(folder / "out", "in the way");
    expect_refused(folder, {folder / "x.toml", "--out", out}, "cannot be written");
}

using AnatomyImport = test::InFolder;

TEST_F(AnatomyImport, WritesWhatCheckAndAScenarioAccept) {
    write(folder / "x.toml", small_tree);
    ASSERT_EQ(run(folder, {"anatomy", "generate", folder / "x.toml", "--out", folder / "made"}).code, 0);
    const Outcome import =
        succeeded(folder, {"anatomy", "import", folder / "made/x.stl", "--unit", "mm", "--inlet", "0,0,0",
                           "--out", folder / "out", "--name", "tube", "--name", "LRA.out=30,0,0", "--body",
                           "abdomen", "--landmark", "0,0,-80", "--scenario", folder / "tube.toml"});
    test::expect_said(import.out, "found: the inlet is the end at");
    test::expect_said(import.out, "pass  open ends: 2; expected: 2 or more");
    const auto scenario = import.out.find("schema = 1");
    ASSERT_NE(scenario, std::string::npos) << import.out;
    EXPECT_EQ(import.out.substr(scenario), read(folder / "tube.toml"));
    write(folder / "tube.gw", "0 beam on\n0..19 advance 0.5 mm\n20 end\n");
    const Outcome check = succeeded(folder, {"anatomy", "check", folder / "out/tube.anatomy.json"});
    EXPECT_EQ(check.out.find("FAIL"), std::string::npos);
    test::expect_said(check.out, "contrast that leaves by LRA.out shows in a kidney");
    const std::string json = read(folder / "out/tube.anatomy.json");
    test::expect_said(json, "\"body\":{\"landmark\":\"aortic bifurcation\",\"at\":[0.0,0.0,-80.0]}");
    test::expect_said(json, "\"names\":\"LRA.out at (30.00, 0.00, 0.00)\"");
    const Outcome used = run(folder, {"run", folder / "tube.toml", "--commands", folder / "tube.gw",
                                      "--frames", "none", "--out", folder / "run"});
    EXPECT_LE(used.code, 1) << used.error;
    EXPECT_EQ(used.error.find("outside the image"), std::string::npos) << used.error;
    succeeded(folder, {"render", folder / "tube.toml", "--out", folder / "tube.png"});
}

TEST_F(AnatomyImport, WhatARunAndAnAnatomyLeaveForSlicerIsReadBack) {
    write(folder / "x.toml", small_tree);
    ASSERT_EQ(run(folder, {"anatomy", "generate", folder / "x.toml", "--out", folder / "made"}).code, 0);
    succeeded(folder, {"anatomy", "import", folder / "made/x.stl", "--unit", "mm", "--out", folder / "first",
                       "--scenario", folder / "first.toml"});
    write(folder / "x.gw",
          "0 beam on\n0..9 advance 0.5 mm\n5 arm lao 20 deg\n7 arm lao -31 deg\n7 arm cranial 12 deg\n10 "
          "end\n");
    EXPECT_LE(run(folder, {"run", folder / "first.toml", "--commands", folder / "x.gw", "--frames", "none",
                           "--slicer", "--out", folder / "run"})
                  .code,
              1);
    EXPECT_EQ(test::names_in(folder / "run/slicer"),
              (std::vector<std::string>{"c_arm_01.mrk.json", "c_arm_02.mrk.json", "c_arm_03.mrk.json",
                                        "wire.mrk.json", "wire_tip.mrk.json"}));
    succeeded(folder, {"anatomy", "export", folder / "first/x.anatomy.json", "--slicer", folder / "slicer"});
    // Surface, names, centrelines and the view of another scenario come from those files alone.
    const std::vector<std::string> again = {"anatomy",
                                            "import",
                                            folder / "slicer/x.stl",
                                            "--unit",
                                            "mm",
                                            "--places",
                                            folder / "slicer/ends.mrk.json",
                                            "--centrelines",
                                            folder / "slicer/centrelines/B1.mrk.json",
                                            "--view",
                                            folder / "run/slicer/c_arm_03.mrk.json",
                                            "--out",
                                            folder / "again",
                                            "--scenario",
                                            folder / "again.toml"};
    succeeded(folder, again);
    const std::string scenario = read(folder / "again.toml");
    test::expect_said(scenario, "[c_arm]\nlao_deg = -31\ncranial_deg = 12\nsid_mm = 1100\nsod_mm = 750\n");
    const std::string isocentre = scenario.substr(scenario.find("isocentre_mm"));
    test::expect_said(read(folder / "first.toml"), isocentre.substr(0, isocentre.find('\n')));
    write(folder / "near.mrk.json",
          R"({"markups": [{"type": "Line", "coordinateSystem": "RAS", "controlPoints": [)"
          R"({"label": "a", "position": [0, 0, 0]}, {"label": "b", "position": [0, 30, 0]}]}]})");
    std::vector<std::string> near = again;
    near[10] = folder / "near.mrk.json";
    test::expect_said(run(folder, near).error, "30 mm from the focal spot to the detector were found");
}

TEST_F(AnatomyImport, AScenarioAndItsAnatomyCanBeMovedTogether) {
    write(folder / "x.toml", small_tree);
    ASSERT_EQ(run(folder, {"anatomy", "generate", folder / "x.toml", "--out", folder / "made"}).code, 0);
    std::filesystem::create_directories(folder / "own/deep");
    const auto import = [&](const std::string& scenario) {
        succeeded(folder, {"anatomy", "import", folder / "made/x.stl", "--unit", "mm", "--inlet", "0,0,0",
                           "--out", "own/mesh", "--name", "tube", "--scenario", scenario});
    };
    import("own/beside.toml");
    import((folder / "own/deep/below.toml").string());
    test::expect_said(read(folder / "own/beside.toml"), "anatomy = \"mesh/tube.anatomy.json\"");
    test::expect_said(read(folder / "own/deep/below.toml"), "anatomy = \"../mesh/tube.anatomy.json\"");
    std::filesystem::create_directories(folder / "elsewhere");
    std::filesystem::rename(folder / "own", folder / "elsewhere/moved");
    for (const char* scenario : {"beside.toml", "deep/below.toml"})
        succeeded(folder, {"list", (folder / "elsewhere/moved") / scenario});
}

TEST_F(AnatomyImport, RefusesBadInputAndWritesNothing) {
    const auto refused = [&](const std::vector<std::string>& words, const std::string& expected) {
        expect_refused(run(folder, test::joined({"anatomy", "import"}, words)), expected);
        EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    };
    write(folder / "x.stl", "not a mesh");
    refused({folder / "x.stl", "--out", folder / "out"}, "expected --unit mm, cm or m");
    refused({folder / "x.stl", "--unit", "mm", "--out", folder / "out"}, "a whole binary STL");
    refused({folder / "x.vtp", "--unit", "mm", "--out", folder / "out"}, "no such mesh can be read");
    refused({folder / "x.stl", "--unit", "mm", "--out", folder / "out", "--name", "a/b"}, "without a folder");
    write(folder / "x.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    refused({folder / "x.obj", "--unit", "mm", "--out", folder / "out"}, "1 triangle was found");
    const std::vector<std::string> known = {folder / "x.obj", "--unit", "mm", "--out", folder / "out"};
    const auto with = [&](const std::vector<std::string>& more, const std::string& expected) {
        refused(test::joined(known, more), expected);
    };
    with({"--axes", "ra"}, "--axes: expected lps or ras, found 'ra' (did you mean 'ras'?)");
    with({"--rotate", "90"}, "expected AXIS:DEG such as z:90");
    with({"--scale", "-1"}, "--scale: -1 was found");
    with({"--body", "leg"}, "expected pelvis, abdomen, chest or head");
    with({"--landmark", "1,2,3"}, "--landmark was given without --body");
    with({"--name", "a", "--name", "b"}, "--name: expected one for the files, and END=X,Y,Z for each end");
    with({"--scenario", folder / "none/x.toml"}, "none/x.toml: cannot be written: No such file");
    with({"--scenario", folder / "x.obj"}, "would overwrite what is read");
    with({"--name", "a=1,2"}, "expected NAME=X,Y,Z in mm");
    const Outcome over =
        run(folder, {"anatomy", "import", folder / "x.stl", "--unit", "mm", "--out", folder.path()});
    test::expect_said(over.error, "would be overwritten");
    EXPECT_EQ(read(folder / "x.stl"), "not a mesh");
    EXPECT_EQ(run(folder, {"anatomy", "check", folder / "none.anatomy.json"}).code, 2);
}

}  // namespace app
