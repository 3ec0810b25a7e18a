#include "engine/anatomy/anatomy.h"

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/scenes.h"
#include "engine/anatomy/vessel_paths.h"
#include "physics/geometry/mesh_topology.h"
#include "tests/anatomies.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::Vec3;
using Json = nlohmann::json;

/// Loads the iliac arteries after `change` to its description; returns the error message.
template <class Change>
std::string refusal_after(Change change) {
    const test::TemporaryFolder folder;
    Json description = Json::parse(test::read(write_anatomy(test::iliac_renal(), folder.path(), {})));
    change(description);
    test::write(folder / "x.anatomy.json", description.dump());
    return test::refusal([&] { load_anatomy(folder / "x.anatomy.json"); });
}

/// Both in one, the second's branch and ends renamed.
Anatomy together(Anatomy a, const Anatomy& b) {
    const int first = static_cast<int>(a.lumen.vertices.size());
    a.lumen.vertices.insert(a.lumen.vertices.end(), b.lumen.vertices.begin(), b.lumen.vertices.end());
    for (const auto& t : b.lumen.triangles)
        a.lumen.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    for (CentrelineBranch branch : b.branches) {
        branch.name = "other";
        a.branches.push_back(branch);
    }
    for (VesselEnd end : b.ends) {
        end.opening.name = "other." + end.opening.name;
        a.ends.push_back(end);
    }
    return a;
}

}  // namespace

TEST(Anatomy, AnEndInsideAnotherBranchIsRefused) {
    const Anatomy wide = tube_anatomy("wide", {{0, 0, 0}, {60, 0, 0}}, 6.0),
                  beside = tube_anatomy("other", {{20, 10, 0}, {20, 40, 0}}, 1.0),
                  within = tube_anatomy("other", {{20, 0, 0}, {20, 40, 0}}, 1.0);
    EXPECT_TRUE(problems(together(wide, beside)).empty());
    const auto found = problems(together(wide, within));
    ASSERT_EQ(found.size(), 1u);
    test::expect_said(
        found[0],
        "lies inside branch 'tube': no vessel can go on past it; expected an end outside all other branches");
}

TEST(Anatomy, VesselsThatWouldRunIntoOthersAreClosedBefore) {
    const auto facing = [](double gap) {
        return together(tube_anatomy("a", {{0, 0, 0}, {40, 0, 0}}, 2.0),
                        tube_anatomy("b", {{40 + gap, 0, 0}, {100 + gap, 0, 0}}, 2.0));
    };
    EXPECT_TRUE(blocked_ends(facing(35)).empty());  // 14 radii are 28 mm
    Anatomy near = facing(20);
    EXPECT_TRUE(problems(near).empty());
    const std::vector<BlockedEnd> found = blocked_ends(near);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(near.ends[found[0].end].opening.name, "end");
    EXPECT_EQ(near.branches[found[0].branch].name, "other");
    EXPECT_NEAR(found[0].free, 20 - 2 - 1.2, 0.6);
    test::expect_said(text_of(near, found[0]), "would run into branch 'other': it is closed");
    test::expect_said(text_of(near, found[0]), "'end' at (40.00, 0.00, 0.00)");
    close_blocked_ends(near, found);
    EXPECT_EQ(near.openings()[found[0].end].length, found[0].free);
    EXPECT_EQ(blocked_ends(near).size(), 2u);  // and is told again
    // What is beside an end from the start blocks nothing.
    EXPECT_TRUE(blocked_ends(together(tube_anatomy("a", {{0, 0, 0}, {40, 0, 0}}, 2.0),
                                      tube_anatomy("b", {{0, 4.5, 0}, {100, 4.5, 0}}, 2.0)))
                    .empty());
}

TEST(Anatomy, IliacArteriesLoadWithTheirBranchesEndsAndTargets) {
    EXPECT_EQ(test::iliac_renal().branches.size(), 10u);
    EXPECT_EQ(test::iliac_renal().ends.size(), 11u);
    ASSERT_EQ(test::iliac_renal().targets.size(), 3u);
    EXPECT_EQ(test::iliac_renal().targets[0].name, "LRA");
    EXPECT_TRUE(inside(test::iliac_renal(), test::iliac_renal().targets[0].centre));
}

TEST(Anatomy, CappedLumenIsClosedAndHoldsItsVolume) {
    const geometry::TriangleMesh closed = closed_lumen(test::iliac_renal());
    EXPECT_EQ(geometry::topology(closed).boundary_edges, 0);
    const double tube = geometry::signed_volume(closed_lumen(test::straight_tube("tube")));
    const double polygon = 24 * 0.5 * 4.0 * std::sin(2 * std::numbers::pi / 24);
    EXPECT_NEAR(tube, 40 * polygon, 1e-6);
}

TEST(Anatomy, AnEndMayBeNamedByItsLastPartWhereThatIsUnique) {
    Anatomy anatomy;
    for (const char* name : {"a+b.out", "c+d.out", "e+d.out", "f.in"}) {
        anatomy.ends.emplace_back();
        anatomy.ends.back().opening.name = name;
    }
    EXPECT_EQ(find_end(anatomy, "a+b.out"), 0);
    EXPECT_EQ(find_end(anatomy, "b.out"), 0);
    EXPECT_EQ(find_end(anatomy, "f.in"), 3);
    for (const char* name : {"d.out", "out", "b", "", "+b.out"})
        EXPECT_FALSE(find_end(anatomy, name)) << name;
}

TEST(Anatomy, HashKnowsEveryPart) {
    const auto hash_with = [](const std::function<void(Anatomy&)>& change) {
        Anatomy anatomy;
        anatomy.lumen.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
        anatomy.lumen.triangles = {{0, 1, 2}};
        anatomy.branches = {{"a", -1, -1, {{0, 0, 0}, {0, 0, 1}}, {1, 1}}};
        anatomy.ends.emplace_back();
        anatomy.targets = {{"t", {0, 0, 1}, 0, 1}};
        change(anatomy);
        return hash_of(anatomy);
    };
    const std::uint64_t same = hash_with([](Anatomy&) {});
    EXPECT_EQ(hash_with([](Anatomy& a) { a.lumen.vertices[0].x() = -0.0; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.lumen.vertices[2].z() = 1e-9; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { std::swap(a.lumen.triangles[0][0], a.lumen.triangles[0][1]); }),
              same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.branches[0].name = "b"; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.branches[0].parent = 0; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.branches[0].parent_sample = 0; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.branches[0].points[1].z() = 2; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.branches[0].radii[1] = 2; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.ends[0].opening.name = "e"; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.ends[0].opening.centre = {1, 0, 0}; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.ends[0].opening.outward_normal = {0.6, 0, 0.8}; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.ends[0].opening.radius = 3; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.targets[0].name = "u"; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.targets[0].centre.x() = 1; }), same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.targets.clear(); }), same);
    const std::uint64_t calcified = hash_with([](Anatomy& a) { a.calcium = {{{{0, 0, 0}}, {1}}}; });
    EXPECT_NE(calcified, same);
    EXPECT_NE(hash_with([](Anatomy& a) { a.calcium = {{{{0, 0, 0}}, {2}}}; }), calcified);
    EXPECT_NE(hash_with([](Anatomy& a) { a.calcium = {{{{0, 0, 1}}, {1}}}; }), calcified);
}

TEST(Anatomy, MissingFileAndThePlaceInBrokenJsonAreNamed) {
    test::expect_refusal([] { load_anatomy("/nowhere/x.json"); }, "/nowhere/x.json");
    const test::TemporaryFolder folder;
    test::write(folder / "x.anatomy.json", "{\n  \"format\": ,\n}");
    test::expect_refusal([&] { load_anatomy(folder / "x.anatomy.json"); }, "x.anatomy.json:2:13");
}

TEST(Anatomy, DescriptionsThatCannotBeAreRefusedWithTheirPlace) {
    const std::pair<std::function<void(Json&)>, std::vector<const char*>> cases[] = {
        {[](Json& j) { j["units"] = "cm"; }, {"expected 'mm'"}},
        {[](Json& j) { j["branches"][2].erase("name"); }, {"branches[2]"}},
        {[](Json& j) { j["targets"][0]["sample"] = 1000; }, {"0 to "}},
        // z of the SMA's outlet
        {[](Json& j) { j["ends"].erase(7); }, {"where no end is declared", "28.0"}},
        {[](Json& j) {
             j["ends"][0]["centre"] = {0, 0, 0};
         },
         {"has no opening"}},
        {[](Json& j) {
             j["body"] = {{"landmark", "knee"}, {"at", {0, 0, 0}}};
         },
         {"body.landmark: \"knee\" was found", "'aortic valve'"}}};
    for (const auto& [change, expected] : cases) {
        const std::string text = refusal_after(change);
        for (const char* part : expected) test::expect_said(text, part);
    }
}

TEST(Anatomy, InvertedLumenAndHoleInTheWallAreRefused) {
    Anatomy inverted = test::straight_tube("tube"), holed = inverted;
    EXPECT_TRUE(problems(inverted).empty());
    for (auto& t : inverted.lumen.triangles) std::swap(t[1], t[2]);
    holed.lumen.triangles.erase(holed.lumen.triangles.begin() + 500);
    for (const auto& [anatomy, said] : {std::pair{inverted, "inward"}, {holed, "3 edges"}}) {
        ASSERT_EQ(problems(anatomy).size(), 1u) << said;
        test::expect_said(problems(anatomy)[0], said);
    }
}

TEST(Anatomy, CentrelinesAndEndsFarFromTheMeshAreRefused) {
    for (const double x : {1e30, 1e6})
        test::expect_said(refusal_after([x](Json& d) { d["branches"][0]["points"][3][0] = x; }),
                          "expected a number up to 10000");
    for (const double x : {9999.0, 500.0}) {
        const std::string text = refusal_after([x](Json& d) { d["branches"][0]["points"][3][0] = x; });
        test::expect_said(text, "': sample 3 is at (");
        test::expect_said(text, "places within it");
    }
    test::expect_said(refusal_after([](Json& d) { d["branches"][1]["points"][2][3] = 1e4; }),
                      "radius of 10000 mm");
    test::expect_said(refusal_after([](Json& d) { d["ends"][0]["centre"] = {0, 0, 9e3}; }), "end '");
    test::expect_said(refusal_after([](Json& d) {
                          for (Json& n : d["ends"][0]["normal"]) n = -n.get<double>();
                      }),
                      "its normal points into branch");
}

TEST(Anatomy, CoordinatesBeyondAPatientAreRefused) {
    Anatomy far = test::straight_tube("tube");
    for (Vec3& v : far.lumen.vertices) v.x() += 2e4;
    ASSERT_FALSE(problems(far).empty());
    test::expect_said(problems(far).front(), "expected coordinates up to 10000 mm");
}

TEST(Anatomy, RadiiThatAreNotThoseOfTheMeshAreRefused) {
    for (const double factor : {3.0, 0.2}) {
        const std::string text = refusal_after([factor](Json& d) {
            for (Json& branch : d["branches"])
                for (Json& sample : branch["points"]) sample[3] = factor * sample[3].get<double>();
        });
        test::expect_said(text, "branch 'aorta+LCIA+LEIA+LCFA', sample ");
        test::expect_said(text, "where the wall of the mesh is ");
    }
    // One sample may lie in an aneurysm, or off the axis.
    EXPECT_EQ(refusal_after([](Json& d) {
                  Json& radius = d["branches"][0]["points"][20][3];
                  radius = 3 * radius.get<double>();
              }),
              "");
}

TEST(Anatomy, ASinusOfTheRootFacesTheMouthsOfTheCoronaryArteries) {
    anatomy::Anatomy aorta = anatomy::tube_anatomy("aorta", {{0, 0, 0}, {0, 0, 80}}, 12.0, 64, 1.0);
    aorta.body = {geometry::Landmark::AorticValve, {1, 2, 0}};
    const auto faces = [&] { return aorta.openings()[0].faces; };
    const auto add = [&](double height, double degrees) {
        const double a = degrees * geometry::degree;
        const geometry::Vec3 from(0, 0, height), way(std::cos(a), std::sin(a), 0.3);
        aorta.branches.push_back({"branch", 0, 0, {from, from + 10 * way, from + 30 * way}, {2, 2, 1.5}});
    };
    /// By how far the nearest of three sinuses turns away from this angle [degrees].
    const auto off = [&](double degrees) {
        const double turn = std::atan2(faces().y(), faces().x()) / geometry::degree - degrees;
        return turn - 120 * std::round(turn / 120);
    };
    EXPECT_TRUE(faces().isZero(0));
    add(60, 200);  // of the arch: no coronary artery
    EXPECT_TRUE(faces().isZero(0));
    add(14, 70);
    EXPECT_NEAR(off(70), 0, 1e-6);
    EXPECT_NEAR(faces().norm(), 1, 1e-12);
    add(16, 210);  // 20 degrees more than a third from the first
    EXPECT_NEAR(off(70), 10, 1e-6);
    EXPECT_NEAR(off(210), -10, 1e-6);
    EXPECT_TRUE(aorta.openings()[1].faces.isZero(0));
}

TEST(Anatomy, WithoutAnOpenEndItIsRefused) {
    Anatomy closed = test::straight_tube("tube");
    closed.lumen = closed_lumen(closed);
    closed.ends.clear();
    ASSERT_FALSE(problems(closed).empty());
    test::expect_said(problems(closed).front(), "the lumen is closed; a wire needs an open end to enter by");
}

TEST(Anatomy, PlaceInTheBodyIsWrittenAndRead) {
    const test::TemporaryFolder folder;
    Anatomy anatomy = test::straight_tube("tube");
    EXPECT_FALSE(load_anatomy(write_anatomy(anatomy, folder.path(), {})).body);
    anatomy.body = {geometry::Landmark::Sella, Vec3(1, -2, 3.5)};
    const std::optional<geometry::BodyPlace> read =
        load_anatomy(write_anatomy(anatomy, folder.path(), {})).body;
    ASSERT_TRUE(read);
    EXPECT_EQ(read->landmark, geometry::Landmark::Sella);
    EXPECT_EQ(read->at, Vec3(1, -2, 3.5));
}

TEST(Anatomy, PathFromAnEndLeadsIntoTheLumenAndUpItsParents) {
    const EntryPath path =
        path_from(test::iliac_renal(), *find_end(test::iliac_renal(), "RCIA+REIA+RCFA.out"));
    const geometry::OpenEnd& end = test::iliac_renal().ends[2].opening;
    EXPECT_TRUE(path.points.front().isApprox(end.centre));
    EXPECT_LT((path.points[1] - path.points[0]).dot(end.outward_normal), 0);
    EXPECT_LT((path.points.back() - Vec3(0, 0, 150)).norm(), 1e-9);  // the root's start
    for (std::size_t i = 2; i < path.points.size(); ++i) {
        EXPECT_LT((path.points[i] - path.points[i - 1]).norm(), 3.0) << i;
    }
}

TEST(Anatomy, CentrelineDistanceGoesRoundTheFork) {
    const Vec3 left = test::iliac_renal().branches[0].points[300],
               right = test::iliac_renal().branches[1].points[100];
    const double along = centreline_distance(test::iliac_renal(), left, right);
    EXPECT_GT(along, 1.2 * (left - right).norm());
    EXPECT_NEAR(along, centreline_distance(test::iliac_renal(), right, left), 1e-9);
    EXPECT_NEAR(centreline_distance(test::straight_tube("tube"), {5, 0, 0}, {30, 0, 0}), 25, 1e-9);
}

TEST(Anatomy, PointsBeyondTheRadiusAreOutside) {
    EXPECT_TRUE(inside(test::straight_tube("tube"), {20, 1.9, 0}));
    EXPECT_FALSE(inside(test::straight_tube("tube"), {20, 2.1, 0}));
    EXPECT_FALSE(inside(test::straight_tube("tube"), {std::nan(""), 0, 0}));
}

}  // namespace anatomy
