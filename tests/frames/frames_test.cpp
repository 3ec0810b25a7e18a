/// Golden frames: each folder tests/frames/CASE is a scenario, its commands, a few frames and the score they
/// must give. README.md beside this file tells how a golden is changed.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>

#include "engine/io/text.h"
#include "engine/run/headless.h"
#include "engine/run/picture_file.h"
#include "render/picture/png.h"
#include "tests/anatomies.h"
#include "tests/frames/comparison.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json read_json(const fs::path& path) {
    std::ifstream file(path);
    return json::parse(file);
}

class Frames : public testing::TestWithParam<std::string> {
protected:
    const fs::path folder = fs::path(SELDINGER_SOURCE) / "tests/frames" / GetParam();
    const fs::path output = fs::path(SELDINGER_FRAME_OUTPUT) / GetParam();
    const bool update = std::getenv("SELDINGER_UPDATE_GOLDENS") != nullptr;
};

std::vector<std::string> cases() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(fs::path(SELDINGER_SOURCE) / "tests/frames"))
        if (entry.is_directory()) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace

TEST_P(Frames, EqualTheirGoldens) {
    // limits.json: how far another processor may be off, and which frames are golden.
    const json limits = read_json(folder / "limits.json");
    fs::create_directories(output);
    const scenario::Scenario scenario = scenario::load_scenario(folder / "scenario.toml");
    const script::CommandScript script = script::load_commands(folder / "commands.gw");
    run::RunOptions options;
    options.cache = test::cache();
    run::run_headless(scenario, script, output, options);

    for (const int frame : limits.at("golden_frames").get<std::vector<int>>()) {
        const std::string name = run::frame_file_name(frame);
        const render::GrayImage actual = render::read_png(output / "frames" / name);
        if (update) {
            run::write_picture(folder / name, actual);
            continue;
        }
        ASSERT_TRUE(fs::exists(folder / name)) << "no golden " << name << "; see tests/frames/README.md";
        const render::GrayImage golden = render::read_png(folder / name);
        ASSERT_EQ(golden.width, actual.width);
        ASSERT_EQ(golden.height, actual.height);
        const render::ImageDifference difference = render::difference(golden, actual);
        const bool good = difference.mean <= limits.at("mean_difference").get<double>() &&
                          difference.largest <= limits.at("largest_difference").get<double>();
        if (!good) {
            run::write_picture(output / ("actual_" + name), actual);
            run::write_picture(output / ("difference_" + name), render::difference_image(golden, actual));
        }
        EXPECT_TRUE(good) << name << ": mean " << difference.mean << ", largest " << difference.largest
                          << ", " << difference.pixels_differing << " pixels differ; look at " << output
                          << "/actual_* and difference_*";
    }

    const fs::path expected_score = folder / "score.json";
    if (update) {
        fs::copy_file(output / "score.json", expected_score, fs::copy_options::overwrite_existing);
        return;
    }
    const auto wrong = test::score_differences(read_json(expected_score), read_json(output / "score.json"),
                                               limits.at("score_tolerance").get<double>());
    EXPECT_TRUE(wrong.empty()) << io::joined(wrong, "\n");
}

INSTANTIATE_TEST_SUITE_P(Case, Frames, testing::ValuesIn(cases()),
                         [](const auto& which) { return which.param; });

TEST(Comparison, NoticesEveryValueOfAScore) {
    const json score = read_json(fs::path(SELDINGER_SOURCE) / "tests/frames/s_bend/score.json");
    EXPECT_TRUE(test::score_differences(score, score, 1e-4).empty());
    const json flat = score.flatten();
    ASSERT_TRUE(flat.contains("/max_penetration_at/joint"));
    for (const auto& [path, value] : flat.items()) {
        json other = flat;
        other[path] = value.is_number_float()     ? json(value.get<double>() * 1.001 + 0.001)
                      : value.is_number_integer() ? json(value.get<int>() + 1)
                      : value.is_boolean()        ? json(!value.get<bool>())
                                                  : json(value.get<std::string>() + "x");
        EXPECT_EQ(test::score_differences(score, other.unflatten(), 1e-4).size(), 1u) << path;
        other.erase(path);
        EXPECT_FALSE(test::score_differences(score, other.unflatten(), 1e-4).empty()) << path;
    }
    json longer = score;
    longer["max_penetration_at"]["more"] = json::array({1, 2});
    EXPECT_EQ(test::score_differences(score, longer, 1e-4).size(), 2u);
}
