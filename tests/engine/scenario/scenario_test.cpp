#include "engine/scenario/scenario.h"

#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <numbers>
#include <regex>

#include "engine/scenario/placement.h"
#include "tests/engine/fixtures.h"

namespace scenario {
namespace {

Scenario parsed(const std::string& toml, const char* file = "s.toml") {
    return parse_scenario(toml, file, test::asset("devices"));
}

std::string refusal_of(const std::string& from, const std::string& to) {
    return test::refusal([&] { test::small_scenario_with(from, to); });
}

}  // namespace

TEST(Scenario, ReadsUnitsIntoMillimetresAndRadians) {
    const Scenario s = parsed(test::small_toml_with("pixels = 64", "lao_deg = 30\ncranial_deg = -10.0"),
                              "folder/small.toml");
    EXPECT_EQ(s.name, "small");
    EXPECT_EQ(s.title, "small");
    EXPECT_DOUBLE_EQ(s.c_arm.lao, std::numbers::pi / 6);
    EXPECT_DOUBLE_EQ(s.c_arm.cranial, -std::numbers::pi / 18);
    ASSERT_EQ(s.wire().device.shape.size(), 1u);
    EXPECT_DOUBLE_EQ(s.wire().device.shape[0].angle, std::numbers::pi / 4);
    EXPECT_DOUBLE_EQ(anatomy::length(s.tube->path), 60 + 25 * 40 * std::numbers::pi / 180);
    EXPECT_EQ(s.budget.updates, 20000);
}

TEST(Scenario, TheSheathTakesTheThickestDeviceAndMayBeStated) {
    const auto with = [](const std::string& keys) {
        return parsed(test::small_toml_with("inserted_mm = 20.0", "inserted_mm = 20.0\n" + keys));
    };
    const auto entry_of = [](const Scenario& s) {
        const anatomy::Anatomy vessels = anatomy_of(s);
        return vessels.ends[*anatomy::find_end(vessels, s.entry.end)].opening;
    };
    EXPECT_NEAR(with("").usual_sheath(), 4.0 / 3, 1e-12);  // 4 F, for a thin wire
    geometry::OpenEnd sheath = entry_of(with(""));
    EXPECT_EQ(sheath.goes_on, geometry::Continuation::Sheath);
    EXPECT_NEAR(sheath.bore, 2.0 / 3, 1e-12);
    EXPECT_EQ(sheath.length, 110);
    sheath = entry_of(with("sheath_F = 6\nsheath_length_mm = 230"));
    EXPECT_NEAR(sheath.bore, 1, 1e-12);
    EXPECT_EQ(sheath.length, 230);
    Scenario thick = with("");
    thick.wire().device.outer_diameter = 1.7;
    EXPECT_NEAR(thick.usual_sheath(), 2, 1e-12);
    test::expect_said(test::refusal([&] { with("sheath_F = 1"); }), "does not take a device of");
}

TEST(Scenario, AnatomyIsFoundBesideTheScenarioFile) {
    std::string text = test::small_toml_with("[tube]", "anatomy = \"../anatomy/x.json\"\n[tube]");
    text.erase(text.find("[tube]"), text.find("[entry]") - text.find("[tube]"));
    EXPECT_EQ(parsed(text, "a/b/s.toml").anatomy, std::filesystem::path("a/b/../anatomy/x.json"));
}

TEST(Scenario, AnatomyIsGrownFromItsSection) {
    const auto with = [](const std::string& section) {
        std::string text = test::small_toml_with("[tube]", section + "\n[tube]");
        text.erase(text.find("[tube]"), text.find("[entry]") - text.find("[tube]"));
        return text;
    };
    const std::string arch = "[anatomy]\npreset = \"arch-1\"\nseed = 3\n";
    const Scenario s = parsed(
        with(arch + "[[anatomy.stenosis]]\nbranch = \"LSA\"\nat_mm = 60\nlength_mm = 8\npercent = 50"));
    ASSERT_TRUE(s.vessels);
    EXPECT_EQ(s.vessels->name, "arch-1-3");
    EXPECT_EQ(s.vessels->stenoses.size(), 1u);
    const auto refused = [&](const std::string& section) {
        return test::refusal([&] { parsed(with(section)); });
    };
    test::expect_said(refused("[anatomy]\npreset = \"arch-4\""), "'arch-4' is not a preset");
    test::expect_said(refused("[anatomy]\nseed = 3"), "preset = \"…\" or a section");
    test::expect_said(refused("[anatomy]\ntree = \"no.toml\""), "no.toml: no such vessel tree");
    test::expect_said(refused("anatomy = 5"), "a file NAME.anatomy.json or a section");
    const std::string nowhere = refused(arch + "[[anatomy.stenosis]]\nbranch = \"XYZ\"\nat_mm = 60\n");
    test::expect_said(nowhere, "XYZ");
}

TEST(Scenario, ShippedScenariosAreSound) {
    const auto files = shipped_scenarios(test::asset("scenarios"));
    ASSERT_FALSE(files.empty());
    for (const auto& file : files)
        EXPECT_FALSE(load_scenario(file, test::asset("devices")).title.empty()) << file;
}

TEST(Scenario, EveryKeyIsInTheReference) {
    const std::string reference = test::read(test::asset("scenarios/README.md"));
    const std::regex key(
        "(?:number|whole|flag|word|choice|point|find|section|sections)\\(\"([A-Za-z0-9_]+)\"");
    int keys = 0;
    for (const char* file : {"engine/scenario/scenario_file.cpp", "engine/scenario/lesson_file.cpp",
                             "engine/anatomy/grow/vessel_file.cpp"}) {
        const std::string source = test::read(std::filesystem::path(SELDINGER_SOURCE) / file);
        for (std::sregex_iterator at(source.begin(), source.end(), key), end; at != end; ++at, ++keys) {
            const std::regex word("[`.\\[{ ]" + (*at)[1].str() + "[`\\] ]");
            EXPECT_TRUE(std::regex_search(reference, word)) << file << ": " << (*at)[1];
        }
    }
    EXPECT_GT(keys, 70);
}

TEST(Scenario, AWallMayBeStifferInPlacesByTermsOrASeed) {
    const auto with = [](const std::string& keys, const std::string& wall = "") {
        return test::small_toml_with("[relaxer]", wall + "[wall.variation]\n" + keys + "\n[relaxer]");
    };
    EXPECT_FALSE(test::small_scenario().wall_variation);
    const Scenario s = parsed(with("terms = [[0.5, 0], [-0.25, 90.0]]"));
    ASSERT_TRUE(s.wall_variation);
    ASSERT_EQ(s.wall_variation->terms.size(), 2u);
    EXPECT_EQ(s.wall_variation->terms[0].amplitude, 0.5);
    EXPECT_DOUBLE_EQ(s.wall_variation->terms[1].phase, std::numbers::pi / 2);
    EXPECT_NE(s.content, test::small_scenario().content);
    EXPECT_EQ(s.content, parsed(with("terms = [[0.5, 0], [-0.25, 90.0]]")).content);
    EXPECT_NE(s.content, parsed(with("terms = [[0.5, 0], [-0.25, 90.5]]")).content);
    const Scenario drawn = parsed(with("seed = 7\nlength_mm = 40"));
    EXPECT_EQ(drawn.wall_variation->length, 40);
    EXPECT_EQ(drawn.wall_variation->terms[0].amplitude, physics::drawn_variation(7).terms[0].amplitude);

    // The wall is stiffer where the terms say so, whatever it is made of; L is the tube's whole length.
    const double whole = 60 + 25 * 40 * std::numbers::pi / 180;
    for (const char* model : {"analytic", "mesh", "distance-field"}) {
        const Scenario varied =
            parsed(with("terms = [[0.5, 0]]", fmt::format("[wall]\nstiffness_N_per_mm = 8\nmodel = "
                                                          "\"{}\"\n",
                                                          model)));
        const auto wall = wall_of(varied, anatomy_of(varied));
        const auto stiffness = [&](const geometry::Vec3& x) {
            physics::WallContact c;
            wall->contacts({&x, 1}, {&c, 1});
            return c.stiffness;
        };
        for (const double s : {5.0, 15.0, 25.0})
            EXPECT_NEAR(stiffness({s, 1.9, 0}), 8 + 4 * std::cos(std::numbers::pi * s / whole), 0.02)
                << model << " " << s;
    }

    const auto refused = [&](const std::string& keys) { return test::refusal([&] { parsed(with(keys)); }); };
    const auto expect = [&](const std::string& keys, const std::string& part) {
        const std::string text = refused(keys);
        EXPECT_NE(text.find(part), std::string::npos) << keys << ": " << text;
    };
    test::expect_said(
        test::refusal([] { parsed(test::small_toml_with("[relaxer]", "[wall]\nvariation = 5\n[relaxer]")); }),
        "s.toml:19:13: [wall] variation = 5 was found; expected a section [wall.variation]");
    expect("", "s.toml:18:1: seed = NUMBER or terms = [[AMPLITUDE_SHARE, PHASE_DEG], ...] is missing");
    expect("seed = 1\nterms = [[0.1, 0]]", "s.toml:20:9: [wall.variation] terms");
    expect("seed = -1", "s.toml:19:8: [wall.variation] seed = -1 was found");
    expect("terms = 0.5", "s.toml:19:9: [wall.variation] terms = 0.5 was found; expected 1 to 64 pairs");
    expect("terms = []", "s.toml:19:9: ");
    expect("terms = [[0.5, 0], [0.4, 0], [-0.1, 0]]", "s.toml:19:9: ");
    expect("terms = [[0.5, 0], [0.4, 0], [-0.1, 0]]",
           "the shares add up to 1, so that the stiffness could "
           "reach 0; expected shares that add up to less than 1");
    expect("terms = [[0.5, 0], [0.25]]",
           "s.toml:19:20: [wall.variation] terms = [ 0.25 ] was found; expected a pair");
    expect("terms = [[0.5, 0], [0.1, 0, 0]]", "s.toml:19:20: ");
    expect("terms = [[0.5, \"a\"]]", "s.toml:19:10: ");
    expect("terms = [[1, 0]]", "s.toml:19:10: ");
    expect("terms = [[nan, 0]]", "s.toml:19:10: ");
    expect("terms = [[0.1, 400]]", "s.toml:19:10: ");
    expect("terms = [0.1, 0]", "s.toml:19:10: ");
    expect("terms = [[0.1, 0]]\nlength_mm = 0", "s.toml:20:13: [wall.variation] length_mm");
    expect("term = [[0.1, 0]]", "s.toml:19:1: unknown key 'term' in [wall.variation]");
}

TEST(Scenario, UnknownKeyIsRefusedWithItsPlaceAndTheKeysThereAre) {
    const std::string text = refusal_of("device =", "devise =");
    test::expect_said(text, "small.toml:13:1: unknown key 'devise' in [guidewire]");
    test::expect_said(text, "did you mean 'device'?");
    test::expect_said(text, "tip_rigidity_N_mm2");
}

TEST(Scenario, SegmentsMayBeChosenAndAdaptive) {
    const Scenario plain = test::small_scenario();
    EXPECT_FALSE(plain.choose_segment_length || plain.adaptive);
    const Scenario s = test::small_scenario_with(
        "torsion = \"rigid\"",
        "torsion = \"rigid\"\nsegment_length_mm = \"auto\"\nadaptive = true\ncurve_tolerance_mm = 0.1");
    EXPECT_TRUE(s.choose_segment_length && s.adaptive);
    EXPECT_EQ(s.refinement.curve_tolerance, 0.1);
    const auto refused = [](const char* line) {
        return test::refusal([&] { test::small_scenario_with("torsion = \"rigid\"", line); });
    };
    test::expect_said(refused("segment_length_mm = \"fine\""), "auto");
    test::expect_said(refused("curve_tolerance_mm = 0"), "curve_tolerance_mm");
}

TEST(Scenario, WireIsAsLongAsItsDeviceOrAsItsKeySays) {
    EXPECT_EQ(test::small_scenario().wire().device.length, 1800);
    const auto with = [](const std::string& line) {
        return test::small_scenario_with("[guidewire]", "[guidewire]\n" + line);
    };
    EXPECT_EQ(with("length_mm = 2600").wire().device.length, 2600);
    const std::string text = test::refusal([] {
        test::small_scenario_with("inserted_mm = 20.0\n[guidewire]",
                                  "inserted_mm = 200.0\n[guidewire]\nlength_mm = 150");
    });
    test::expect_said(text, "small.toml:11:");
    test::expect_said(text, "a wire of 150 mm cannot be in by 200 mm");
}

TEST(Scenario, RelaxersOfThePaperHaveTheirWords) {
    const auto relaxer = [](const std::string& lines) {
        return test::small_scenario_with("[relaxer]", "[relaxer]\n" + lines).relaxer;
    };
    using enum physics::RelaxerKind;
    EXPECT_EQ(relaxer("kind = \"geometric\"").kind, Geometric);
    EXPECT_EQ(relaxer("kind = \"combined\"").kind, Combined);
    EXPECT_EQ(relaxer("kind = \"konings\"").kind, Konings);
    EXPECT_TRUE(relaxer("kind = \"segment\"\nstored_planes = true").stored_planes);
    test::expect_refusal([&] { relaxer("kind = \"fem\""); }, "combined");
}

TEST(Scenario, EverythingWrongIsListedInTheOrderOfTheFile) {
    const std::string text = refusal_of("radius_mm = 2.0\naround = 16", "radius_mm = -1\naround = \"many\"");
    const auto first = text.find("small.toml:5:"), second = text.find("small.toml:6:");
    ASSERT_NE(first, std::string::npos) << text;
    ASSERT_NE(second, std::string::npos) << text;
    EXPECT_LT(first, second);
    test::expect_said(text, "6 to 512");
}

TEST(Scenario, WhatMakesNoScenarioIsRefused) {
    struct Case {
        const char *from, *to, *said;
    };
    for (const Case& c : std::vector<Case>{
             {"[imaging]", "[image]", "unknown key 'image' at the top"},
             {"inserted_mm = 20.0", "inserted_mm = nan", "inserted_mm"},
             {"inserted_mm = 20.0", "inserted_mm = inf", "inserted_mm"},
             {"inserted_mm = 20.0", "inserted_mm = 1e9", "1 to 2000"},
             {"[40.0, 10.0, 0.0]", "[40.0, nan, 0.0]", "isocentre_mm"},
             {"end = \"start\"\n", "", "end"},
             {"schema = 1\n", "", "schema"},
             {"schema = 1\n", "schema = 2\n", "schema"},
             {"seed = 3", "seed = = 3", "small.toml:3:"},
             {"[tube]", "anatomy = \"x.json\"\n[tube]", "expected one of"},
             {"name = \"end\"", "name = \"end\"\ncentre_mm = [1, 2, 3]", "expected one of them"},
             {"radius_mm = 2.0", "radius_mm = 0.4", "does not fit"}}) {
        SCOPED_TRACE(c.to);
        test::expect_said(refusal_of(c.from, c.to), c.said);
    }
}

}  // namespace scenario
