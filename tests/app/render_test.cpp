#include "render/picture/png.h"
#include "tests/app/program.h"

namespace app {
namespace {

using test::asset, test::read, test::run, test::s_bend_run, test::TemporaryFolder, test::write;

/// Refused with exit code 2 and a message; nothing is written.
void expect_render_refused(const std::vector<std::string>& words, const std::string& message) {
    const TemporaryFolder folder;
    const auto result = run(folder, test::joined({"render", "s_bend", "--out", folder / "x.png"}, words));
    EXPECT_EQ(result.code, 2);
    EXPECT_NE((result.error + result.out).find(message), std::string::npos) << result.error << result.out;
    EXPECT_FALSE(std::filesystem::exists(folder / "x.png"));
}

}  // namespace

using Render = test::InFolder;

TEST_F(Render, LeavesOneImageOfEachMode) {
    std::vector<std::string> bytes;
    for (const char* mode : {"live", "dsa", "roadmap", "cine"}) {
        const std::string file = folder / (std::string(mode) + ".png");
        succeeded(folder,
                  {"render", "s_bend", "--frame", "20", "--lao", "20", "--mode", mode, "--out", file});
        EXPECT_GT(render::read_png(file).width, 100);
        bytes.push_back(read(file));
    }
    EXPECT_NE(bytes[0], bytes[1]);
    EXPECT_NE(bytes[0], bytes[2]);
    EXPECT_NE(bytes[0], bytes[3]);
}

TEST_F(Render, OfAFrameIsTheFrameOfTheRunWithoutItsLag) {
    write(folder / "x.gw", "0..5 advance 2 mm\n6 beam on\n6 end\n");
    run(folder, s_bend_run(folder / "out", {}, folder / "x.gw"));
    run(folder,
        {"render", "s_bend", "--commands", folder / "x.gw", "--frame", "6", "--out", folder / "x.png"});
    EXPECT_EQ(read(folder / "x.png"), read(folder / "out/frames/frame_000006.png"));
}

TEST_F(Render, AnglesModesFramesAndContrastThereAreNotAreRefused) {
    expect_render_refused({"--lao", "130"}, "LAO/RAO angle must lie within 120 degrees");
    expect_render_refused({"--cranial", "-50"}, "cranial/caudal angle must lie within 45 degrees");
    expect_render_refused({"--lao", "nan"}, "--lao: expected a number, found 'nan'");
    expect_render_refused({"--mode", "fluoro"}, "expected live, dsa, roadmap or cine");
    expect_render_refused({"--frame", "-1"}, "--frame");
    expect_render_refused({"--frame", "40000"}, "the script ends at 40: expected 0 to 40");
    expect_render_refused({"--mode", "dsa", "--iodine", "900"}, "--iodine");
}

TEST_F(Render, PatientOfAScenarioAndItsCtLookAlike) {
    const std::string body = test::small_toml_with("patient = false", "patient = true\ntube_voltage_kV = 80");
    write(folder / "mesh.toml", body);
    write(folder / "ct.toml", body + "[patient]\nct = \"mine.nii.gz\"\n");
    write(folder / "no.gw", "0 beam on\n0 end\n");
    EXPECT_EQ(run(folder, {"render", folder / "ct.toml", "--out", folder / "ct.png"}).code, 2);
    const auto voxels = succeeded(folder, {"anatomy", "voxelise", folder / "mesh.toml", "--voxel", "2",
                                           "--margin", "120", "--out", folder / "mine.nii.gz"});
    test::expect_said(voxels.out, "voxels of 2 mm");
    for (const char* name : {"mesh", "ct"}) {
        succeeded(folder, {"render", folder / (std::string(name) + ".toml"), "--commands", folder / "no.gw",
                           "--out", folder / (std::string(name) + ".png")});
    }
    // Of the same noise: what is left are edges.
    EXPECT_LT(
        render::difference(render::read_png(folder / "mesh.png"), render::read_png(folder / "ct.png")).mean,
        8);
    EXPECT_EQ(run(folder, {"anatomy", "voxelise", folder / "ct.toml", "--out", folder / "x.nii"}).code, 2);
    EXPECT_EQ(
        run(folder, {"anatomy", "voxelise", folder / "mesh.toml", "--voxel", "6", "--out", folder / "x.dcm"})
            .code,
        2);
}

}  // namespace app
