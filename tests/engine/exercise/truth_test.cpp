
#include <nlohmann/json.hpp>

#include "engine/exercise/exercise.h"
#include "engine/run/headless.h"
#include "engine/run/truth_files.h"
#include "render/picture/png.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

/// Of the small scenario, moved, at 128 pixels.
Truth small_truth(const std::vector<script::Command>& commands, const std::string& motion = "") {
    std::string text = test::small_toml_with("pixels = 64", "pixels = 128") + motion;
    if (!motion.empty()) text.replace(text.find("patient = false"), 15, "patient = true");
    Exercise exercise(test::small_scenario(text), true);
    exercise.next_frame(commands);
    return exercise.truth();
}

std::uint8_t at(const render::GrayImage& mask, double x, double y) {
    return mask.pixels[static_cast<std::size_t>(y) * mask.width + static_cast<std::size_t>(x)];
}

}  // namespace

TEST(Truth, JointsLieOnTheWiresMaskAndInTheVesselsMask) {
    const Truth truth =
        small_truth({script::Beam{true}, script::Advance{30}, script::MoveArm{0.4, -0.2, {}, {}, 120.0, {}}});
    int seen = 0;
    for (const geometry::Vec3& joint : truth.pulse.devices[0].joints) {
        const render::Pixel p = render::project(truth.pulse.arm, joint);
        if (p.x < 2 || p.y < 2 || p.x >= 126 || p.y >= 126) continue;
        ++seen;
        EXPECT_EQ(at(truth.devices[0], p.x, p.y), 255);
        if (joint.x() > 2) {
            EXPECT_EQ(at(truth.vessels, p.x, p.y), 255);
        }
    }
    EXPECT_GT(seen, 20);
    const auto set = [](const render::GrayImage& mask) {
        return std::count(mask.pixels.begin(), mask.pixels.end(), 255);
    };
    EXPECT_GT(set(truth.vessels), set(truth.devices[0]));
    EXPECT_LT(set(truth.vessels), 128 * 128 / 4);
}

TEST(Truth, PartsAreThoseOfThePulse) {
    std::string text = test::small_toml_with("pixels = 64", "pixels = 128");
    text.replace(text.find("patient = false"), 15, "patient = true");
    Exercise exercise(test::small_scenario(text), Pictures::All);
    exercise.next_frame(std::vector<script::Command>{script::Beam{true}, script::Advance{30}});
    EXPECT_FALSE(exercise.truth().signal);
    TruthParts parts;
    parts.signal = parts.expected = parts.labels = parts.lengths = true;
    const Truth truth = exercise.truth(parts);
    // Poisson noise, blurred and with the electronics' own: the mean over the image stays.
    double signal = 0, expected = 0, apart = 0;
    for (std::size_t i = 0; i < truth.signal->values.size(); ++i) {
        signal += truth.signal->values[i];
        expected += truth.expected->values[i];
        apart += std::abs(truth.signal->values[i] - truth.expected->values[i]);
    }
    EXPECT_NEAR(signal / expected, 1, 0.01);
    EXPECT_GT(apart, 0.005 * expected);
    // A label wherever the mask has a vessel, but along its silhouette: labels are of four rays a pixel, the
    // mask of one.
    ASSERT_EQ(truth.branches.size(), exercise.simulation().anatomy().branches.size());
    int vessels = 0, differ = 0;
    for (std::size_t i = 0; i < truth.labels->pixels.size(); ++i) {
        vessels += truth.vessels.pixels[i] != 0;
        differ += (truth.vessels.pixels[i] != 0) != (truth.labels->pixels[i] != 0);
        EXPECT_LE(truth.labels->pixels[i], truth.branches.size());
    }
    EXPECT_GT(vessels, 50);
    EXPECT_LT(differ, vessels / 2);
    // The lumen's layer is the vessels' mask; a layer is as long as the body at most.
    ASSERT_GT(truth.lengths.size(), 5u);
    const auto& lumen = truth.lengths.back();
    EXPECT_EQ(lumen.name, "lumen");
    for (std::size_t i = 0; i < lumen.length.values.size(); ++i)
        EXPECT_EQ(lumen.length.values[i] > 0, truth.vessels.pixels[i] != 0);
    for (const auto& layer : truth.lengths)
        for (const float length : layer.length.values) EXPECT_TRUE(length >= 0 && length < 900) << layer.name;
}

TEST(Truth, TheCameraMatrixProjectsWhatTheFileLists) {
    const Truth truth = small_truth({script::Beam{true}, script::MoveArm{0.4, -0.2, {}, {}, {}, {}}});
    const nlohmann::json json = nlohmann::json::parse(run::to_json(truth, {7, 7, (7 + 1) / 15.0}));
    EXPECT_EQ(json["frame"], 7);
    ASSERT_EQ(json["wire_mm"].size(), truth.pulse.devices[0].joints.size());
    for (std::size_t i = 0; i < json["wire_mm"].size(); ++i) {
        double projected[3] = {};
        for (int row = 0; row < 3; ++row) {
            projected[row] = json["camera_matrix"][row][3];
            for (int k = 0; k < 3; ++k)
                projected[row] +=
                    json["camera_matrix"][row][k].get<double>() * json["wire_mm"][i][k].get<double>();
        }
        EXPECT_NEAR(projected[0] / projected[2], json["wire_px"][i][0].get<double>(), 1e-9);
        EXPECT_NEAR(projected[1] / projected[2], json["wire_px"][i][1].get<double>(), 1e-9);
    }
    EXPECT_EQ(json["tip_px"], json["wire_px"].back());
}

TEST(Truth, TellsWhatTheCollimatorLeaves) {
    const auto json = [](const script::Command& command) {
        return nlohmann::json::parse(
            run::to_json(small_truth({script::Beam{true}, script::Advance{20}, command}), {0, 0, 1 / 15.0}));
    };
    const auto open = json(script::Collimate{1000, 1000}), narrow = json(script::Collimate{60, 3});
    EXPECT_EQ(open["collimator_px"], (std::vector<double>{0, 0, 128, 128}));
    const double half_width = 0.5 * 128 * 60 / 300, half_height = 0.5 * 128 * 3 / 300;
    EXPECT_NEAR(narrow["collimator_px"][0].get<double>(), 64 - half_width, 1e-9);
    EXPECT_NEAR(narrow["collimator_px"][3].get<double>(), 64 + half_height, 1e-9);
    EXPECT_TRUE(open["tip_in_image"].get<bool>());
    EXPECT_FALSE(narrow["tip_in_image"].get<bool>());
}

TEST(Truth, NamesTheFrameOfItsPulseAfterAReset) {
    Exercise exercise(test::small_scenario(), true);
    exercise.next_frame(std::vector<script::Command>{script::Beam{true}});
    exercise.next_frame(std::vector<script::Command>{script::Advance{2}});
    exercise.next_frame(std::vector<script::Command>{script::Reset{}, script::Beam{true}});
    EXPECT_EQ(exercise.truth().pulse.time.index, 2);
    exercise.next_frame(std::vector<script::Command>{script::Beam{false}});
    EXPECT_EQ(exercise.truth().pulse.time.index, 2);
}

TEST(Truth, FollowsVesselsThatMove) {
    const std::vector<script::Command> commands = {script::Beam{true}};
    const Truth still = small_truth(commands);
    const Truth moved = small_truth(
        commands,
        "[motion]\nheart_rate_per_min = 20\nbreathing_rate_per_min = 60\nbreathing_reach_mm = [0, 0, 40]\n");
    const geometry::Vec3 shift = moved.pulse.exposure.vessel_shift;
    ASSERT_GT(shift.norm(), 0.01);
    const auto tip = [](const Truth& truth) {
        return nlohmann::json::parse(run::to_json(truth, {0, 0, (0 + 1) / 15.0}))["tip_mm"];
    };
    EXPECT_NEAR(tip(moved)[2].get<double>() - tip(still)[2].get<double>(), shift.z(), 1e-12);
    EXPECT_EQ(moved.pulse.devices[0].joints, still.pulse.devices[0].joints)
        << "the wire rests in the vessels' frame";
}

TEST(Truth, ARunWritesItBesideEachImage) {
    const test::TemporaryFolder folder;
    run::RunOptions options;
    options.every = 2;
    options.truth = true;
    run::run_headless(test::small_scenario(),
                      script::parse_commands("0 beam on\n1 advance 3 mm\n4 end\n", "x.gw"), folder / "out",
                      options);
    for (const char* name : {"frame_000000", "frame_000002", "frame_000004"}) {
        const std::filesystem::path file = folder / "out/truth" / name;
        const nlohmann::json json = nlohmann::json::parse(test::read(file.string() + ".json"));
        EXPECT_EQ(render::read_png(folder / "out/truth" / json["wire_mask"].get<std::string>()).width, 64);
        EXPECT_EQ(render::read_png(folder / "out/truth" / json["vessel_mask"].get<std::string>()).width, 64);
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "out/truth/frame_000001.json"));
}

}  // namespace exercise
