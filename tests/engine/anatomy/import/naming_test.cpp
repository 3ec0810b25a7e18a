#include "engine/anatomy/import/naming.h"

#include <fmt/format.h>
#include <random>
#include <set>

#include "engine/anatomy/import/lumen_import.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::Vec3;
using test::expect_said, test::refusal, test::small_anatomy;

/// The small tree as it is imported: the inlet at the origin, "main" as B1, "side" as B2.
Anatomy nameless() {
    Anatomy anatomy = small_anatomy();
    anatomy.targets.clear();
    for (int b = 0; b < 2; ++b) {
        anatomy.branches[b].name = b == 0 ? "B1" : "B2";
        anatomy.targets.push_back({anatomy.branches[b].name, anatomy.branches[b].points[3], b, 3});
    }
    for (std::size_t e = 0; e < 3; ++e) {
        anatomy.ends[e].opening.name = "END" + std::to_string(e + 1);
        anatomy.ends[e].role = e == 0 ? EndRole::Inlet : EndRole::Outlet;
    }
    return anatomy;
}

const Vec3 inlet(0, 0, 0), outlet(30, 0, 0);

Vec3 side_end() {
    return small_anatomy().branches[1].points.back();
}

std::string all_names(const Anatomy& anatomy) {
    std::string text;
    for (const auto& branch : anatomy.branches) text += branch.name + " ";
    for (const auto& end : anatomy.ends) text += end.opening.name + " ";
    for (const auto& target : anatomy.targets) text += target.name + " ";
    return text;
}

std::string named(const std::vector<NamedPlace>& places, const std::vector<GivenLine>& lines = {}) {
    Anatomy anatomy = nameless();
    give_names(anatomy, lines, places);
    return all_names(anatomy);
}

}  // namespace

TEST(Naming, AnEndNamesItsBranchAndTarget) {
    EXPECT_EQ(named({}), "B1 B2 END1 END2 END3 B1 B2 ");
    EXPECT_EQ(named({{"LRA", side_end()}}), "B1 LRA END1 END2 LRA B1 LRA ");
    EXPECT_EQ(named({{"LRA.out", side_end() + Vec3(0, 1, 0)}}), "B1 LRA END1 END2 LRA.out B1 LRA ");
    EXPECT_EQ(named({{"aorta.in", inlet}}), "aorta B2 aorta.in END2 END3 aorta B2 ");
    EXPECT_EQ(named({{"aorta.in", inlet}, {"RCFA.out", outlet}}),
              "aorta+RCFA B2 aorta.in RCFA.out END3 RCFA B2 ");
    EXPECT_EQ(named({{"B2", inlet}}), "B2 B2_2 B2 END2 END3 B2 B2_2 ");
}

TEST(Naming, BranchesTakeTheNamesOfTheLinesAlongThem) {
    const auto& branches = small_anatomy().branches;
    const GivenLine stem{"aorta", {Vec3(1, 0.3, 0), Vec3(29, 0, 0.3)}, {}},
        side{"LRA", branches[1].points, {}};
    EXPECT_EQ(named({}, {stem, side}), "aorta LRA aorta.in aorta.out LRA.out aorta LRA ");
    EXPECT_EQ(named({}, {side}), "B1 LRA END1 END2 LRA.out B1 LRA ");
    // Lines from the root to every tip: the one that ends there names a branch.
    GivenLine whole{"renal", {Vec3(0, 0, 0), Vec3(12, 0, 0)}, {}};
    whole.points.insert(whole.points.end(), branches[1].points.begin(), branches[1].points.end());
    EXPECT_EQ(named({}, {whole, stem}), "aorta renal aorta.in aorta.out renal.out aorta renal ");
    EXPECT_EQ(named({{"X", side_end()}}, {stem, side}), "aorta X aorta.in aorta.out X aorta X ");
    const GivenLine first{"aorta", {Vec3(1, 0, 0), Vec3(10, 0, 0)}, {}},
        middle{"LCIA", {Vec3(11, 0, 0), Vec3(18, 0, 0)}, {}},
        last{"LEIA", {Vec3(21, 0, 0), Vec3(29, 0, 0)}, {}};
    EXPECT_EQ(named({}, {first, middle, last}),
              "aorta LCIA LEIA B2 aorta.in LEIA.out END3 LEIA LCIA aorta B2 ");
    const GivenLine far{"far", {Vec3(0, 50, 0), Vec3(30, 50, 0)}, {}};
    EXPECT_EQ(named({}, {far}), "B1 B2 END1 END2 END3 B1 B2 ");
    GivenLine other = side;
    other.name = "aorta";
    EXPECT_EQ(named({}, {stem, other}), "aorta aorta_2 aorta.in aorta.out aorta_2.out aorta aorta_2 ");
}

namespace {

/// A tree of straight tubes: a stem along x, and children that leave it along y, each three radii apart.
Anatomy comb(int children) {
    Anatomy anatomy;
    const auto add = [&](const Vec3& from, const Vec3& way, int count, double radius, int parent,
                         int sample) {
        geometry::CentrelineBranch branch;
        branch.name = fmt::format("B{}", anatomy.branches.size() + 1);
        branch.parent = parent, branch.parent_sample = sample;
        for (int i = 0; i <= count; ++i) {
            branch.points.push_back(from + i * way);
            branch.radii.push_back(radius);
        }
        anatomy.targets.push_back({branch.name, branch.points[static_cast<std::size_t>(count * 9 / 10)],
                                   static_cast<int>(anatomy.branches.size()), count * 9 / 10});
        anatomy.branches.push_back(branch);
        VesselEnd end;
        end.opening.name = fmt::format("END{}", anatomy.ends.size() + 2);
        end.opening.centre = branch.points.back();
        end.opening.outward_normal = way.normalized();
        end.opening.radius = radius;
        anatomy.ends.push_back(end);
    };
    add(Vec3(0, 0, 0), Vec3(1, 0, 0), 200, 4, -1, -1);
    for (int c = 0; c < children; ++c) add(Vec3(20 + 12 * c, 0, 0), Vec3(0, 1, 0), 60, 2, 0, 20 + 12 * c);
    VesselEnd inlet;
    inlet.opening.name = "END1";
    inlet.opening.outward_normal = -Vec3::UnitX();
    inlet.opening.radius = 4;
    inlet.role = EndRole::Inlet;
    anatomy.ends.insert(anatomy.ends.begin(), inlet);
    return anatomy;
}

}  // namespace

TEST(Naming, EveryNameOfALineIsABranchOrATargetOrItsLossIsTold) {
    std::mt19937 random(5);
    const auto up_to = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most + 1)); };
    int split = 0, places = 0, lost = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        const int children = up_to(6);
        Anatomy anatomy = comb(children);
        std::vector<GivenLine> lines;
        const auto add = [&](geometry::Polyline points) {
            for (Vec3& p : points) p += Vec3(up_to(8) - 4, up_to(8) - 4, up_to(8) - 4) / 10;
            lines.push_back({fmt::format("line {}", lines.size()), std::move(points), {}});
        };
        // Pieces of the stem one after the other, whole ways from the inlet, children, lines elsewhere.
        for (int from = up_to(30); from < 190;) {
            const int to = std::min(200, from + 1 + up_to(120));
            if (up_to(4) > 0) add({Vec3(from, 0, 0), Vec3(0.5 * (from + to), 0, 0), Vec3(to, 0, 0)});
            from = to + (up_to(3) == 0 ? up_to(40) : 0);
        }
        for (int c = 0; c < children; ++c) {
            const double x = 20 + 12 * c;
            if (up_to(2) == 0) add({Vec3(0, 0, 0), Vec3(x, 0, 0), Vec3(x, 60, 0)});
            if (up_to(2) == 0) add({Vec3(x, up_to(5), 0), Vec3(x, 10 + up_to(50), 0)});
        }
        if (up_to(3) == 0) add({Vec3(0, -50, 0), Vec3(30, -50, 0)});
        std::shuffle(lines.begin(), lines.end(), random);
        const std::size_t before = anatomy.branches.size();
        std::string told;
        for (const Finding& finding : give_names(anatomy, lines, {})) told += text_of(finding) + "\n";
        split += static_cast<int>(anatomy.branches.size() - before);
        for (const GivenLine& line : lines) {
            const bool branch = std::ranges::find(anatomy.branches, line.name, &CentrelineBranch::name) !=
                                anatomy.branches.end();
            const auto target = std::ranges::find(anatomy.targets, line.name, &VesselTarget::name);
            places += !branch && target != anatomy.targets.end();
            lost += !branch && target == anatomy.targets.end();
            EXPECT_TRUE(branch || target != anatomy.targets.end() ||
                        told.find("'" + line.name + "'") != std::string::npos)
                << trial << ": " << line.name << "\n"
                << told;
        }
        // What was one branch is a chain of parts that goes on from sample to sample.
        double length = 0;
        std::set<std::string> names;
        for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
            const CentrelineBranch& part = anatomy.branches[b];
            EXPECT_TRUE(names.insert(part.name).second) << trial << ": " << part.name;
            ASSERT_GE(part.points.size(), 2u);
            for (std::size_t i = 1; i < part.points.size(); ++i)
                length += (part.points[i] - part.points[i - 1]).norm();
            if (part.parent < 0) continue;
            ASSERT_LT(part.parent, static_cast<int>(b));
            EXPECT_EQ(anatomy.branches[static_cast<std::size_t>(part.parent)]
                          .points[static_cast<std::size_t>(part.parent_sample)],
                      part.points.front())
                << trial;
            EXPECT_LT(geometry::joined_branch(anatomy.branches, anatomy.openings(), static_cast<int>(b)), 0);
        }
        EXPECT_NEAR(length, 200 + 60 * children, 1e-9);
        for (const VesselTarget& target : anatomy.targets)
            EXPECT_EQ(anatomy.branches[static_cast<std::size_t>(target.branch)]
                          .points[static_cast<std::size_t>(target.sample)],
                      target.centre);
    }
    EXPECT_GT(split, 1000);
    EXPECT_GT(places, 100);
    EXPECT_GT(lost, 100);
}

TEST(Naming, ABranchEndsWhereANameEnds) {
    Anatomy anatomy = comb(2);
    const GivenLine trunk{"trunk", {Vec3(0, 0, 0), Vec3(80, 0, 0)}, {}},
        left{"left", {Vec3(80, 0, 0), Vec3(199, 0, 0)}, {}},
        side{"side", {Vec3(32, 0, 0), Vec3(32, 58, 0)}, {}};
    const std::vector<Finding> said = give_names(anatomy, std::vector{trunk, left, side}, {});
    EXPECT_TRUE(said.empty()) << text_of(said[0]);
    EXPECT_EQ(all_names(anatomy), "trunk left B2 side trunk.in left.out END3 side.out left trunk B2 side ");
    EXPECT_NEAR(anatomy.branches[0].points.back().x(), 80, 1.5);
    EXPECT_EQ(anatomy.branches[1].parent, 0);
    EXPECT_EQ(anatomy.branches[3].parent, 0);
    EXPECT_EQ(anatomy.branches[3].parent_sample, 32);
}

TEST(Naming, WhatCannotBeNamedIsRefused) {
    const auto said = [](const std::vector<NamedPlace>& places) { return refusal([&] { named(places); }); };
    expect_said(said({{"A", Vec3(15, 20, 0)}}), "from the nearest end; expected at most");
    expect_said(said({{"A", inlet}, {"B", inlet}}), "'A' and 'B' both name the end at");
    expect_said(said({{"A", inlet}, {"A", outlet}}), "'A' names two ends");
    EXPECT_EQ(parse_named_place("LCFA=1,-2.5,3e1").at, Vec3(1, -2.5, 30));
    EXPECT_EQ(parse_named_place("a b=1,2,3").name, "a b");
    for (const char* wrong : {"=1,2,3", "a=1,2", "a=1,2,3,4", "a=1,2,x", "a=", "a\n=1,2,3", "a\"=1,2,3"})
        test::expect_refusal([&] { parse_named_place(wrong); }, "--name");
    EXPECT_NE(refusal([] { parse_named_place(std::string(61, 'a') + "=1,2,3"); }), "");
}

TEST(FileFrame, AxesScaleAndTurnsLeadToThePatient) {
    const auto place = [](const FileFrame& frame) -> Vec3 {
        return to_patient(frame, frame.axes) * Vec3(1, 2, 3);
    };
    EXPECT_EQ(place({}), Vec3(1, 2, 3));
    EXPECT_EQ(place({2, "ras", {}}), Vec3(-2, -4, 6));
    EXPECT_EQ(place({1, "lps", {"z:90"}}), Vec3(-2, 1, 3));
    EXPECT_EQ(place({1, "lps", {"z:90", "x:-90"}}), Vec3(-2, 3, -1));
    EXPECT_NEAR(to_patient({3, "", {"y:33"}}, "ras").determinant(), 27, 1e-12);
    for (const char* wrong : {"", "z", "z:", "w:90", "z:nan", "z:400", "90"})
        test::expect_refusal([&] { to_patient({1, "", {wrong}}); }, "--rotate");
    test::expect_refusal([] { to_patient({0, "", {}}); }, "--scale: 0 was found");
}

TEST(FileFrame, MeshCentrelinesAndPlacesMeetInThePatient) {
    const test::TemporaryFolder folder;
    // Written in centimetres, with x to the right and y to the front, half as large.
    std::string obj;
    const auto written = [](const Vec3& p) -> Vec3 { return Vec3(-p.x(), -p.y(), p.z()) / 20; };
    for (const Vec3& v : small_anatomy().lumen.vertices) {
        const Vec3 w = written(v);
        obj += fmt::format("v {} {} {}\n", w.x(), w.y(), w.z());
    }
    for (const auto& t : small_anatomy().lumen.triangles)
        obj += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    const auto line = [&](const geometry::CentrelineBranch& branch) {
        std::string text;
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            const Vec3 w = written(branch.points[i]);
            text +=
                fmt::format("{}[{},{},{},{}]", i > 0 ? "," : "", w.x(), w.y(), w.z(), branch.radii[i] / 20);
        }
        return text;
    };
    test::write(folder / "a.obj", obj);
    test::write(folder / "a.json", "{\"side\":[" + line(small_anatomy().branches[1]) + "],\"main\":[" +
                                       line(small_anatomy().branches[0]) + "]}");
    ImportOptions options;
    options.unit = "cm";
    options.inlet = inlet;
    options.frame = {2, "ras", {}};
    options.names = {{"far.out", outlet}};
    options.centrelines = {folder / "a.json"};
    const ImportedLumen lumen = import_lumen(folder / "a.obj", options);
    EXPECT_EQ(all_names(lumen.anatomy), "far side far.in far.out side.out far side ");
    EXPECT_NEAR((lumen.anatomy.ends[0].opening.centre - inlet).norm(), 0, 0.4);
    const bool compared =
        std::any_of(lumen.findings.begin(), lumen.findings.end(), [](const Finding& finding) {
            return finding.text.find("radii given with the centrelines are 1.0") == 0 ||
                   finding.text.find("radii given with the centrelines are 0.9") == 0;
        });
    EXPECT_TRUE(compared);
}

TEST(BodyPlace, LandmarkIsGivenOrGuessed) {
    Anatomy anatomy = nameless();
    expect_said(place_in_part(anatomy, "pelvis", std::nullopt), "the aortic bifurcation lies at");
    ASSERT_TRUE(anatomy.body);
    EXPECT_EQ(anatomy.body->landmark, geometry::Landmark::AorticBifurcation);
    EXPECT_EQ(anatomy.body->at, anatomy.branches[1].points.front());
    place_in_part(anatomy, "abdomen", Vec3(1, 2, 3));
    EXPECT_EQ(anatomy.body->at, Vec3(1, 2, 3));
    expect_said(place_in_part(anatomy, "chest", std::nullopt), "the aortic valve lies at");
    EXPECT_TRUE(anatomy.body->at == anatomy.ends[0].opening.centre ||
                anatomy.body->at == anatomy.ends[1].opening.centre);
    expect_said(place_in_part(anatomy, "head", std::nullopt), "the sella lies at");
    test::expect_refusal([&] { place_in_part(anatomy, "foot", std::nullopt); },
                         "--body: 'foot' was found; expected pelvis, abdomen, chest or head");
}

}  // namespace anatomy
