#include "engine/run/headless.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/anatomy/import/given_centrelines.h"
#include "physics/geometry/polyline.h"
#include "render/picture/png.h"
#include "tests/engine/fixtures.h"

namespace run {
namespace {

const char* const script_text = "0 beam on\n1..8 advance 3 mm\n4 rotate 40 deg\n9 arm lao 20 deg\n12 end\n";

script::CommandScript script(const std::string& text = script_text) {
    return script::parse_commands(text, "x.gw");
}

RunOptions fast() {
    RunOptions options;
    options.images = false;
    return options;
}

}  // namespace

using Headless = test::InFolder;

TEST_F(Headless, LeavesRecordingScoreSheetAndFrames) {
    const RunResult result = run_headless(test::small_scenario(), script(), folder / "out", {});
    EXPECT_EQ(result.frames, 13);
    EXPECT_EQ(test::names_in(folder / "out"),
              (std::vector<std::string>{"frames", "run.gw", "score.json", "sheet.png"}));
    EXPECT_EQ(test::names_in(folder / "out/frames").size(), 13u);
    EXPECT_EQ(nlohmann::json::parse(test::read(folder / "out/score.json"))["frames"], 13);
}

TEST_F(Headless, AngiogramsAreOneForEachStretchOfBeamAtOnePose) {
    const char* const text =
        "0 beam on\n5 arm lao 20 deg\n9 mode dsa\n12 beam off\n14 beam on\n16 mask\n18 reset\n20 end\n";
    RunOptions options;
    options.dicom = dicom::Pixels::Shown;
    run_headless(test::small_scenario(), script(text), folder / "out", options);
    // Live AP, live LAO, DSA, DSA again after the pause, with a new mask, after the reset.
    const std::vector<std::string> names = test::names_in(folder / "out/dicom");
    EXPECT_EQ(names, (std::vector<std::string>{"xa_0001.dcm", "xa_0002.dcm", "xa_0003.dcm", "xa_0004.dcm",
                                               "xa_0005.dcm"}));
    const RunResult again = run_headless(test::small_scenario(), script(text), folder / "again", options);
    EXPECT_EQ(again.frames, 21);
    for (const std::string& name : names)
        EXPECT_EQ(test::read(folder / "out/dicom" / name), test::read(folder / "again/dicom" / name)) << name;
    options.dicom = dicom::Pixels::Signal;
    run_headless(test::small_scenario(), script(text), folder / "again", options);
    EXPECT_GT(std::filesystem::file_size(folder / "again/dicom/xa_0001.dcm"),
              1.9 * static_cast<double>(std::filesystem::file_size(folder / "out/dicom/xa_0001.dcm")));
    run_headless(test::small_scenario(), script(text), folder / "again", {});
    EXPECT_FALSE(std::filesystem::exists(folder / "again/dicom/xa_0001.dcm"));
}

TEST_F(Headless, MarkupsOfSlicerAreTheDeviceAndItsPoses) {
    RunOptions options = fast();
    options.slicer = true;
    geometry::Polyline wire, tip;
    options.observer = [&](const exercise::Frame& frame, exercise::Exercise&) {
        wire = frame.simulation.path_of(script::DeviceRole::Wire);
        tip.push_back(wire.back());
    };
    run_headless(test::small_scenario(), script(), folder / "out", options);
    EXPECT_EQ(test::names_in(folder / "out/slicer"),
              (std::vector<std::string>{"c_arm_01.mrk.json", "c_arm_02.mrk.json", "wire.mrk.json",
                                        "wire_tip.mrk.json"}));
    const auto read = [&](const char* file) {
        return anatomy::load_centrelines(folder / "out/slicer" / file, 1).lines.at(0).points;
    };
    const auto distance = [](const geometry::Polyline& line, const geometry::Vec3& x) {
        double least = 1e9;
        for (std::size_t i = 1; i < line.size(); ++i) {
            const double t = geometry::closest_fraction(line[i - 1], line[i], x);
            least = std::min(least, (line[i - 1] + t * (line[i] - line[i - 1]) - x).norm());
        }
        return least;
    };
    const geometry::Polyline again = read("wire.mrk.json"), way = read("wire_tip.mrk.json");
    for (const geometry::Vec3& p : wire) EXPECT_LT(distance(again, p), 1e-3) << p.transpose();
    EXPECT_LT((again.back() - wire.back()).norm(), 1e-3);
    EXPECT_LT((way.front() - tip.front()).norm(), 1e-3);
    for (const geometry::Vec3& p : tip) EXPECT_LT(distance(way, p), 1) << p.transpose();
    options.slicer = false;
    run_headless(test::small_scenario(), script(), folder / "out", options);
    EXPECT_TRUE(test::names_in(folder / "out/slicer").empty());
}

TEST_F(Headless, TruthInSixteenBitsStatesWhatItsLevelsMean) {
    RunOptions options;
    options.every = 4;
    options.truth = true;
    options.truth_parts = {true, true, true, true};
    run_headless(test::small_scenario(), script(), folder / "out", options);
    const auto json = nlohmann::json::parse(test::read(folder / "out/truth/frame_000012.json"));
    for (const char* key : {"signal", "expected", "vessel_labels"}) {
        const render::DeepImage image =
            render::read_deep_png(folder / ("out/truth/" + json[key]["file"].get<std::string>()));
        EXPECT_EQ(image.width, 64) << key;
    }
    EXPECT_GT(json["signal"]["quanta_per_level"], 0);
    EXPECT_EQ(json["vessel_labels"]["branches"].size(), 1u);
    // The arm turned at frame 9: lengths of the first and of the third image, and the last has those.
    ASSERT_EQ(json["layer_lengths"]["layers"].size(), 1u);
    EXPECT_EQ(json["layer_lengths"]["layers"][0]["file"], "frame_000012_length_00.png");
    const render::DeepImage lengths = render::read_deep_png(folder / "out/truth/frame_000012_length_00.png");
    // A lumen of 4 mm under pixels as wide: chords in hundredths of a millimetre, at pixels' middles.
    const std::uint16_t longest = *std::max_element(lengths.pixels.begin(), lengths.pixels.end());
    EXPECT_GT(longest, 150);
    EXPECT_LT(longest, 5000);
    EXPECT_FALSE(std::filesystem::exists(folder / "out/truth/frame_000004_length_00.png"));
    EXPECT_TRUE(std::filesystem::exists(folder / "out/truth/frame_000000_length_00.png"));
    run_headless(test::small_scenario(), script(), folder / "out", {});
    EXPECT_TRUE(test::names_in(folder / "out/truth").empty());
}

TEST_F(Headless, EveryKthFrameAndTheLastAreShown) {
    RunOptions options;
    options.every = 5;
    run_headless(test::small_scenario(), script(), folder / "out", options);
    std::vector<std::string> expected;
    for (const int frame : {0, 5, 10, 12}) expected.push_back(frame_file_name(frame));
    EXPECT_EQ(test::names_in(folder / "out/frames"), expected);
}

TEST_F(Headless, SameCommandsTwiceGiveTheSameStateAndBytes) {
    const RunResult one = run_headless(test::small_scenario(), script(), folder / "1", {});
    const RunResult two = run_headless(test::small_scenario(), script(), folder / "2", {});
    EXPECT_EQ(one.state_hash, two.state_hash);
    for (const std::string& name : test::names_in(folder / "1/frames")) {
        EXPECT_EQ(test::read(folder / ("1/frames/" + name)), test::read(folder / ("2/frames/" + name)))
            << name;
    }
    for (const char* name : {"run.gw", "score.json", "sheet.png"}) {
        EXPECT_EQ(test::read(folder / "1" / name), test::read(folder / "2" / name)) << name;
    }
}

TEST_F(Headless, ImagesHaveNoEffectOnTheState) {
    EXPECT_EQ(run_headless(test::small_scenario(), script(), folder / "out", {}).state_hash,
              run_headless(test::small_scenario(), script()).state_hash);
}

TEST(Replay, OfARecordingReachesTheSameState) {
    const test::TemporaryFolder folder;
    const RunResult first = run_headless(test::small_scenario(), script(), folder / "1", fast());
    const RunResult again = run_headless(test::small_scenario(), script::load_commands(folder / "1/run.gw"),
                                         folder / "2", fast());
    EXPECT_EQ(again.state_hash, first.state_hash);
    EXPECT_EQ(again.compared_states, 3);  // frames 0, 10 and 12
    EXPECT_TRUE(again.differences.empty());
    EXPECT_EQ(test::read(folder / "2/run.gw"), test::read(folder / "1/run.gw"));
}

TEST(Replay, OfOtherCommandsIsTold) {
    const test::TemporaryFolder folder;
    run_headless(test::small_scenario(), script(), folder / "1", {});
    RunOptions options;
    options.expect = folder / "1";
    const script::CommandScript other =
        script("0 beam on\n1..8 advance 3 mm\n4 rotate 41 deg\n9 arm lao 20 deg\n12 end\n");
    const RunResult result = run_headless(test::small_scenario(), other, folder / "2", options);
    EXPECT_EQ(result.compared_frames, 13);
    ASSERT_FALSE(result.differences.empty());
    test::expect_said(result.differences[0], "frame 4 differs");
}

TEST(Replay, OfAResetReachesTheStateOfAFreshRun) {
    const RunResult fresh = run_headless(test::small_scenario(), script("0..5 advance 3 mm\n8 end\n"));
    const RunResult used =
        run_headless(test::small_scenario(),
                     script("0..9 advance 2 mm\n3 rotate 80 deg\n20 reset\n20..25 advance 3 mm\n28 end\n"));
    EXPECT_EQ(used.state_hash, fresh.state_hash);
}

TEST_F(Headless, InterruptionLeavesAValidRecordingOfTheWholeFrames) {
    RunOptions options = fast();
    int asked = 0;
    options.interrupted = [&asked] { return ++asked == 6; };
    const RunResult result = run_headless(test::small_scenario(), script(), folder / "1", options);
    EXPECT_TRUE(result.interrupted);
    EXPECT_EQ(result.frames, 6);
    EXPECT_TRUE(nlohmann::json::parse(test::read(folder / "1/score.json"))["interrupted"].get<bool>());
    const RunResult again = run_headless(test::small_scenario(), script::load_commands(folder / "1/run.gw"),
                                         folder / "2", fast());
    EXPECT_EQ(again.frames, 6);
    EXPECT_EQ(again.state_hash, result.state_hash);
    EXPECT_TRUE(again.differences.empty());
}

TEST_F(Headless, InterruptionLeavesTheTruthOfAFrameWholeOrNotAtAll) {
    for (int asks = 1; asks < 9; ++asks) {
        const test::TemporaryFolder fresh;
        RunOptions options;
        options.truth = true;
        options.truth_parts = {true, true, true, true};
        int asked = 0;
        options.interrupted = [&] { return ++asked >= asks; };
        EXPECT_TRUE(run_headless(test::small_scenario(), script(), fresh / "out", options).interrupted);
        const std::vector<std::string> names = test::names_in(fresh / "out/truth");
        const auto is_there = [&](const std::string& name) { return std::ranges::count(names, name) == 1; };
        for (const std::string& name : names) {
            EXPECT_TRUE(is_there(name.substr(0, 12) + ".json")) << name;
            if (!name.ends_with(".json")) continue;
            const auto json = nlohmann::json::parse(test::read(fresh / "out/truth" / name));
            for (const char* key : {"wire_mask", "vessel_mask"}) EXPECT_TRUE(is_there(json[key])) << name;
            for (const char* key : {"signal", "expected", "vessel_labels"})
                EXPECT_TRUE(is_there(json[key]["file"])) << name;
            for (const auto& layer : json["layer_lengths"]["layers"])
                EXPECT_TRUE(is_there(layer["file"])) << name;
        }
    }
}

TEST_F(Headless, TimeLimitEndsTheRun) {
    scenario::Scenario scenario = test::small_scenario();
    scenario.time_limit = 0.4;
    const RunResult result = run_headless(scenario, script());
    EXPECT_TRUE(result.time_is_up);
    EXPECT_EQ(result.frames, 6);
}

TEST_F(Headless, RunGoesOnForTheHoldAfterTheLastCommand) {
    // 0.2 s at 15 Hz are 3 frames, and one more.
    EXPECT_EQ(run_headless(test::small_scenario(), script("5 advance 1 mm\n")).frames, 10);
}

TEST_F(Headless, CommandsThatCannotBeAreRefusedBeforeAnythingIsWritten) {
    const char* const cases[][3] = {
        {"3 arm sid 600 mm sod 1200 mm\n", "x.gw:1:", ""},
        {"1 inject 200 ml at 20 ml/s into tube\n9 inject 150 ml at 20 ml/s into tube\n", "x.gw:2:3",
         "100"}};  // what is left
    for (const auto& [commands, begin, part] : cases) {
        const std::string text = test::refusal(
            [&] { run_headless(test::small_scenario(), script(commands), folder / "out", {}); });
        EXPECT_EQ(text.find(begin), 0u) << text;
        test::expect_said(text, part);
        EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    }
}

TEST_F(Headless, PanelIsKeptBesideTheFrames) {
    RunOptions options;
    options.every = 4;
    options.panel = true;
    const script::CommandScript commands = script("0 beam on\n1..8 advance 3 mm\n8 end\n");
    run_headless(test::small_scenario(), commands, folder / "out", options);
    EXPECT_EQ(test::names_in(folder / "out/panel"), test::names_in(folder / "out/frames"));
    const std::string first = test::read(folder / "out/panel/frame_000004.png");
    run_headless(test::small_scenario(), commands, folder / "out", options);
    EXPECT_EQ(test::read(folder / "out/panel/frame_000004.png"), first);
}

TEST_F(Headless, StopOfTheWireIsNoticed) {
    const RunResult result = run_headless(test::small_scenario(), script("0 beam on\n0 withdraw 100 mm\n"));
    ASSERT_EQ(result.notices.size(), 1u);
    test::expect_said(result.notices[0], "withdrawal stopped");
}

TEST_F(Headless, ProgressIsToldAfterEachFrame) {
    RunOptions options;
    std::vector<int> frames;
    options.progress = [&](const Progress& p) { frames.push_back(p.frame * 100 + p.frames); };
    run_headless(test::small_scenario(), script("2 end\n"), options);
    EXPECT_EQ(frames, (std::vector<int>{103, 203, 303}));
}

}  // namespace run
