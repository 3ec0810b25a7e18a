#include "engine/author/check.h"

#include "engine/author/starter.h"
#include "engine/run/picture_file.h"
#include "tests/engine/fixtures.h"

namespace author {
namespace {

using Verdict = Finding::Verdict;

struct CheckTest : test::InFolder {
    /// What is found of the small scenario, with `to` in place of `from`.
    std::vector<Finding> found(const std::string& from = "title", const std::string& to = "title",
                               bool solution = false, bool picture = false) const {
        test::write(folder / "mine.toml", test::small_toml_with(from, to));
        const scenario::ExerciseFiles files{"mine", folder / "mine.toml",
                                            solution ? folder / "mine.gw" : std::filesystem::path(),
                                            picture ? folder / "mine.png" : std::filesystem::path()};
        return check(files, test::asset("devices"), {});
    }
    static const Finding* of(const std::vector<Finding>& all, const std::string& what) {
        const auto one = std::ranges::find(all, what, &Finding::what);
        return one == all.end() ? nullptr : &*one;
    }
    /// Holds that this is wrong, and says so.
    static void expect_wrong(const std::vector<Finding>& all, const std::string& what,
                             const std::string& said,
                             const std::source_location& where = std::source_location::current()) {
        EXPECT_FALSE(is_usable(all));
        const Finding* one = of(all, what);
        ASSERT_NE(one, nullptr) << what;
        EXPECT_EQ(one->verdict, Verdict::Wrong);
        test::expect_said(one->said, said, where);
    }
};

}  // namespace

TEST_F(CheckTest, WhatIsFineIsSaidAndWhatIsMissingIsNoFault) {
    const std::vector<Finding> all = found();
    EXPECT_TRUE(is_usable(all));
    for (const char* what : {"scenario", "vessels", "entry", "target", "wall, image"})
        EXPECT_EQ(of(all, what)->verdict, Verdict::Fine) << what << ": " << of(all, what)->said;
    EXPECT_EQ(of(all, "solution")->verdict, Verdict::Missing);
    EXPECT_EQ(of(all, "picture")->verdict, Verdict::Missing);
}

TEST_F(CheckTest, EverythingThatARunRefusesIsWrong) {
    expect_wrong(found("title", "titel"), "scenario", "did you mean 'title'?");
    expect_wrong(found("end = \"start\"", "end = \"begin\""), "entry", "'begin' is no open end");
    expect_wrong(found("inserted_mm = 20.0", "inserted_mm = 900.0"), "entry", "900 mm of wire");
    expect_wrong(found("name = \"end\"", "name = \"goal\""), "target", "'goal' is no target");
    expect_wrong(found("name = \"end\"", "centre_mm = [0.0, 90.0, 0.0]"), "target", "outside the anatomy");
    expect_wrong(found("radius_mm = 2.0", "radius_mm = 0.4"), "scenario", "does not fit");
    expect_wrong(found("device = \"glide035\"", "device = \"glide036\""), "scenario", "glide035");
    // Two at once are both told.
    const auto both = found("end = \"start\"\ninserted_mm = 20.0\n", "end = \"begin\"\ninserted_mm = 20.0\n");
    expect_wrong(both, "entry", "no open end");
    EXPECT_EQ(of(both, "target")->verdict, Verdict::Fine);
}

TEST_F(CheckTest, ATargetThatTheWireCannotReachIsWrong) {
    const auto with = [&](const std::string& radius, const std::string& branch) {
        const std::string tube = test::small_toml, from = tube.substr(tube.find("[tube]"));
        std::string vessels =
            "[anatomy]\n[[anatomy.branch]]\nname = \"main\"\npoints_mm = [[0, 0, 0, 2], [20, "
            "0, 0, 2], [60, 0, 0, 2]]\n[[anatomy.branch]]\nname = \"side\"\nparent = "
            "\"main\"\nat_mm = 40\npoints_mm = [[0, 0, 0, " +
            radius + "], [6, 10, 0, " + radius + "], [12, 30, 0, " + radius +
            "]]\n[[anatomy.target]]\nname = \"end\"\nbranch = \"" + branch + "\"\nat_mm = 15\n";
        std::string more = from.substr(from.find("[entry]"));
        more = test::replaced(more, "end = \"start\"", "end = \"main.in\"");
        test::write(folder / "mine.toml", tube.substr(0, tube.find("[tube]")) + vessels + more);
        return check({"mine", folder / "mine.toml", {}, {}}, test::asset("devices"), {});
    };
    expect_wrong(with("0.3", "side"), "target", "'side' is 0.6 mm wide at its narrowest on the way");
    const auto wide = with("1.0", "side");
    EXPECT_EQ(of(wide, "target")->verdict, Verdict::Fine) << of(wide, "target")->said;
    test::expect_said(of(wide, "target")->said, "in 'side'; the narrowest on the way is 2.0 mm wide");
}

TEST_F(CheckTest, TheSolutionIsPlayed) {
    test::write(folder / "mine.gw", "0 beam on\n1..60 advance 1 mm\n80 end\n");
    test::expect_said(of(found("title", "title", true), "solution")->said, "reaches the target after ");
    test::write(folder / "mine.gw", "1 advance 1 mm\n");
    expect_wrong(found("title", "title", true), "solution", "it does not reach the target");
    test::write(folder / "mine.gw", "1 advance catheter 1 mm\n");
    expect_wrong(found("title", "title", true), "solution", "catheter");
    test::write(folder / "mine.gw", "1 push 1 mm\n");
    expect_wrong(found("title", "title", true), "solution", "mine.gw:1:");
}

TEST_F(CheckTest, ThePictureIsRead) {
    test::write(folder / "mine.png", "no picture");
    expect_wrong(found("title", "title", false, true), "picture", "mine.png");
    write_thumbnail(folder / "mine.png", test::small_scenario(), {});
    EXPECT_EQ(of(found("title", "title", false, true), "picture")->said, "256 x 256 pixels");
}

TEST_F(CheckTest, TheThumbnailShowsVesselsAndNoWire) {
    write_thumbnail(folder / "start.png", test::small_scenario(), {});
    const render::GrayImage image = run::read_picture(folder / "start.png");
    std::size_t dark = 0;
    for (const std::uint8_t level : image.pixels) dark += level < 150;
    EXPECT_GT(dark, image.pixels.size() / 500);  // a tube of 4 mm
}

TEST(Starter, IsAScenarioWithATitleOfItsOwnAndWithoutTheBenchmarkOfAnother) {
    const auto parsed = [](const std::string& text) {
        return scenario::parse_scenario(text, "mine.toml", test::asset("devices"));
    };
    EXPECT_EQ(parsed(starter("mine")).title, "mine: from the right groin into the aorta");
    const test::TemporaryFolder folder;
    for (const auto& file : scenario::shipped_scenarios(test::asset("scenarios"))) {
        const scenario::Scenario copy =
            parsed(starter_from(file, "mine", folder.path(), test::asset("devices")));
        const scenario::Scenario source = scenario::load_scenario(file, test::asset("devices"));
        EXPECT_EQ(copy.title, "mine, from " + source.name);
        EXPECT_FALSE(copy.lesson.benchmark.given()) << file;
        EXPECT_EQ(copy.content, source.content) << file;  // the same exercise, until its author changes it
        EXPECT_EQ(copy.lesson.briefing, source.lesson.briefing);
    }
}

TEST(Starter, OfAScenarioWithFilesBesideItIsRefused) {
    const test::TemporaryFolder folder;
    test::write(
        folder / "own.toml",
        test::replaced(test::small_toml,
                       "[tube]\nradius_mm = 2.0\naround = 16\nstep_mm = 1.0\npath = [{run_mm = 30.0}, "
                       "{arc_radius_mm = 25.0, angle_deg = 40.0}, {run_mm = 30.0}]\n",
                       "anatomy = \"x.anatomy.json\"\n"));
    std::filesystem::create_directories(folder / "elsewhere");
    test::expect_refusal(
        [&] { starter_from(folder / "own.toml", "mine", folder / "elsewhere", test::asset("devices")); },
        "it names a file beside it, x.anatomy.json");
}

}  // namespace author
