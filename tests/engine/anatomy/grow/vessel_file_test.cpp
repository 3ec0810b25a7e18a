#include "engine/anatomy/grow/vessel_file.h"

#include <numbers>

#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using test::refusal;

const std::string good = R"(schema = 1
[[branch]]
name = "main"
points_mm = [[0, 0, 0, 2], [15, 0, 0, 2], [30, 0, 0, 1.8]]
[[branch]]
name = "side"
parent = "main"
at_mm = 12
points_mm = [[0, 0, 0, 1.2], [3, 4, 0, 1.2], [8, 11, 2, 1]]
[[target]]
name = "far"
branch = "side"
at_mm = 9
[[stenosis]]
branch = "main"
at_mm = 22
length_mm = 6
percent = 40
)";

std::string refusal_of(const std::string& from, const std::string& to) {
    return refusal([&] { parse_vessel_file(test::replaced(good, from, to), "vessels/x.toml"); });
}

}  // namespace

TEST(VesselFile, IsReadWithEverythingInIt) {
    const VesselTreeSpec spec = parse_vessel_file(good, "vessels/small.toml");
    EXPECT_EQ(spec.name, "small");
    ASSERT_EQ(spec.branches.size(), 2u);
    EXPECT_EQ(spec.branches[1].parent, "main");
    EXPECT_EQ(spec.branches[1].at, 12);
    EXPECT_EQ(spec.branches[1].knots[2].place, geometry::Vec3(8, 11, 2));
    EXPECT_EQ(spec.branches[1].knots[2].radius, 1);
    EXPECT_EQ(spec.targets[0].branch, "side");
    EXPECT_EQ(spec.stenoses[0].percent, 40);
}

TEST(VesselFile, ModifiesAPreset) {
    const VesselTreeSpec spec = parse_vessel_file(
        "schema = 1\npreset = \"lca\"\n[[stenosis]]\nbranch = \"LCX\"\nat_mm = 30\nlength_mm = 8\npercent = "
        "60\n",
        "tight.toml");
    EXPECT_EQ(spec.name, "tight");
    EXPECT_EQ(spec.branches[0].name, "LM+LAD");
    EXPECT_EQ(spec.stenoses[0].branch, "LCX");
}

TEST(VesselFile, TellsWhatIsWrongAndWhere) {
    test::expect_said(refusal_of("schema = 1", "schema = "), "vessels/x.toml:1:");
    test::expect_said(refusal_of("at_mm = 12", "at_mm = \"far\""), "x.toml:8:9: [branch 2] at_mm = ");
    test::expect_said(refusal_of("at_mm = 12", "at_m = 12"),
                      "unknown key 'at_m' in [branch 2] (did you mean 'at_mm'?)");
    test::expect_said(refusal_of("[15, 0, 0, 2]", "[15, 0, 0]"), "x.toml:4:");
    test::expect_said(refusal_of("[15, 0, 0, 2]", "[15, 0, 0, nan]"),
                      "expected four numbers x, y, z and radius");
    test::expect_said(refusal_of("percent = 40", "percent = 140"), "x.toml:18:");
    test::expect_said(refusal_of("[15, 0, 0, 2]", "[15, 0, 0, 200]"), "a radius of 200 mm was found");
    test::expect_refusal([] { parse_vessel_file("schema = 1\npreset = \"lac\"\n", "x.toml"); },
                         "x.toml:2:10: 'lac' is not a preset (did you mean 'lca'?)");
    test::expect_refusal([] { parse_vessel_file("schema = 1\n", "x.toml"); },
                         "a section [[branch]] is missing");
    test::expect_refusal([] { load_vessel_file("/nowhere/x.toml"); }, "no such vessel tree can be read");
}

TEST(VesselFile, ABranchMayJoinAnother) {
    const std::string way_round =
        good +
        "[[branch]]\nname = \"bypass\"\nparent = \"main\"\nat_mm = 4\njoins = "
        "\"main\"\njoins_at_mm = 27\npoints_mm = [[0, 0, 0, 1], [3, -7, 0, 1], [20, "
        "-7, 0, 1], [23, 0, 0, 1]]\n";
    const VesselTreeSpec spec = parse_vessel_file(way_round, "x.toml");
    EXPECT_EQ(spec.branches[2].joins, "main");
    EXPECT_EQ(spec.branches[2].joins_at, 27);
    const auto without = [&](const std::string& line) {
        std::string text = way_round;
        text.erase(text.find(line), line.size());
        return refusal([&] { parse_vessel_file(text, "x.toml"); });
    };
    test::expect_said(without("joins_at_mm = 27\n"), "joins_at_mm");
    test::expect_said(without("joins = \"main\"\n"), "unknown key 'joins_at_mm' in [branch 3]");
}

TEST(VesselFile, RefusesASeedWithoutAPreset) {
    EXPECT_EQ(parse_vessel_file(good, "x.toml", 0).branches.size(), 2u);
    test::expect_refusal([] { parse_vessel_file(good, "x.toml", 7); },
                         "seed 7 was given; expected a preset for it, and there is none here");
    EXPECT_FALSE(parse_vessel_file("schema = 1\npreset = \"rca\"\n", "x.toml", 7).branches.empty());
}

TEST(VesselFile, SaysWhoThePatientIs) {
    const auto read = [](const std::string& lines) {
        return parse_vessel_file("schema = 1\npreset = \"rca\"\n" + lines, "x.toml");
    };
    const Patient patient = *read("sex = \"f\"\nage = 71\nheight_cm = 158\nweight_kg = 61\n").patient;
    EXPECT_EQ(patient.sex, Sex::Female);
    EXPECT_EQ(patient.age, 71);
    EXPECT_EQ(patient.height, 1580);
    EXPECT_EQ(patient.weight, 61);
    EXPECT_LT(read("sex = \"f\"\n").branches[0].knots[0].radius, read("").branches[0].knots[0].radius);
    test::expect_refusal([&] { read("sex = \"x\"\n"); }, "x.toml:3:7: sex = ");
    test::expect_refusal([&] { read("sex = \"x\"\n"); }, "expected f, m");
    test::expect_refusal([&] { read("age = 7\n"); }, "x.toml:3:7: age = ");
    test::expect_refusal([&] { read("height_cm = 1600\n"); }, "expected a number from 135 to 215");
    test::expect_refusal([&] { read("weight = 60\n"); }, "did you mean 'weight_kg'?");
    test::expect_refusal(
        [&] {
            std::string text = good;
            text.insert(text.find("[[branch]]"), "age = 50\n");
            parse_vessel_file(text, "x.toml");
        },
        "expected a preset for it, and there is none here");
    PatientWish old;
    old.age = 80;
    EXPECT_EQ(parse_vessel_file("schema = 1\npreset = \"rca\"\n", "x.toml", 0, old).patient->age, 80);
    test::expect_refusal([&] { parse_vessel_file(good, "x.toml", 0, old); },
                         "expected a preset whose patient they describe");
    EXPECT_EQ(parse_sex("m"), Sex::Male);
    test::expect_refusal([] { parse_sex("male"); }, "--sex: 'male' was found; expected f or m");
}

TEST(VesselFile, ModifiersAreReadFromShortWords) {
    EXPECT_EQ(parse_stenosis("LM+LAD:54:12:70").length, 12);
    EXPECT_EQ(parse_aneurysm("M1:10:7:4").neck, 4);
    EXPECT_NEAR(parse_aneurysm("M1:10:7:4:90").angle, std::numbers::pi / 2, 1e-12);
    EXPECT_EQ(parse_tortuosity("1.5:20").branch, "");
    EXPECT_EQ(parse_tortuosity("1.5:20:LRA").branch, "LRA");
    test::expect_refusal([] { parse_stenosis("LAD:54:twelve:70"); },
                         "--stenosis: 'LAD:54:twelve:70' was found; expected BRANCH:AT:LENGTH:PERCENT");
    test::expect_refusal([] { parse_aneurysm("M1:10:7"); }, "expected BRANCH:AT:DIAMETER:NECK[:ANGLE]");
}

}  // namespace anatomy
