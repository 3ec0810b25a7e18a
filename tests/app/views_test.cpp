/// `seldinger views`.

#include <nlohmann/json.hpp>

#include "render/picture/png.h"
#include "tests/app/program.h"

namespace app {
namespace {

using test::read, test::run, test::succeeded, test::write;
using Views = test::InFolder;
using Json = nlohmann::json;

}  // namespace

TEST_F(Views, OfAnExerciseAreAMapTheBestThreeAndTheirAngiograms) {
    const test::Outcome told = succeeded(folder, {"views", "s_bend", "--out", "views", "--cache", "cache"});
    test::expect_said(told.out, "mm from its origin\n  view                foreshortened  covered  cost\n  ");
    const Json document = Json::parse(read(folder / "views/views.json"));
    EXPECT_EQ(document["schema"], 1);
    EXPECT_EQ(document["scenario"], "s_bend");
    ASSERT_EQ(document["steps"].size(), 1u);
    const Json& step = document["steps"][0];
    EXPECT_EQ(step["angles"], 931);
    EXPECT_EQ(step["ostium"], false);
    ASSERT_EQ(step["best"].size(), 3u);
    for (const Json& best : step["best"]) {
        EXPECT_LE(best["cost"], best["least_cost"]["cost"].get<double>() + 0.0153);
        EXPECT_NEAR(best["cost"],
                    1 - (1 - best["foreshortening"].get<double>()) * (1 - best["overlap"].get<double>()),
                    1e-5);
    }
    const std::string csv = read(folder / "views/views.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 932);
    for (const char* picture :
         {"views/views_best_1.png", "views/views_best_2.png", "views/views_best_3.png"}) {
        const render::GrayImage image = render::read_png(folder / picture);
        ASSERT_GT(image.width, 100);
        // The filled vessel is darker than what was subtracted, in the middle of the picture.
        const auto at = [&](int x, int y) {
            return image.pixels[static_cast<std::size_t>(y) * image.width + x];
        };
        EXPECT_LT(at(image.width / 2, image.height / 2) + 20, at(image.width / 8, image.height / 8))
            << picture;
    }
    EXPECT_TRUE(std::filesystem::exists(folder / "views/views.gp"));
    EXPECT_EQ(std::filesystem::exists(folder / "views/views.png"), told.error.empty());
    // The same again is the same, and the text of --json is the file's.
    EXPECT_EQ(Json::parse(succeeded(folder, {"views", "s_bend", "--json", "--cache", "cache"}).out),
              document);
}

TEST_F(Views, AreOfTheStretchThatIsAskedFor) {
    const auto steps = [&](const std::vector<std::string>& more) {
        return Json::parse(
            succeeded(folder, test::joined({"views", "s_bend", "--json", "--cache", "cache"}, more))
                .out)["steps"];
    };
    const Json one = steps({"--branch", "tube", "--from-mm", "10", "--to-mm", "25", "--step-deg", "10"})[0];
    EXPECT_EQ(one["stretches"][0], Json::parse(R"({"branch": "tube", "from_mm": 10.0, "to_mm": 25.0})"));
    EXPECT_EQ(one["angles"], 225);
    EXPECT_GE(steps({"--way"}).size(), 1u);
    write(folder / "file", "");
    test::expect_refused(run(folder, {"views", "s_bend", "--out", folder / "file"}), "cannot be written");
}

}  // namespace app
