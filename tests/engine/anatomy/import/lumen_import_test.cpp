#include "engine/anatomy/import/lumen_import.h"

#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/import/import_run.h"
#include "engine/studies/anatomy_sign.h"
#include "physics/wall/distance_field.h"
#include "tests/engine/anatomy/trees.h"
#include "tests/engine/anatomy/tubes.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using test::refusal, test::tube;

ImportOptions millimetres() {
    ImportOptions options;
    options.unit = "mm";
    return options;
}

ImportedLumen imported(const TriangleMesh& mesh, const ImportOptions& options = millimetres()) {
    return import_lumen(mesh, "small", options);
}

bool reports(const ImportedLumen& lumen, const std::string& text) {
    return std::any_of(lumen.findings.begin(), lumen.findings.end(),
                       [&](const Finding& f) { return f.text.find(text) != std::string::npos; });
}

void expect_parts(const ImportedLumen& lumen, std::size_t ends, std::size_t branches) {
    EXPECT_EQ(lumen.anatomy.ends.size(), ends);
    EXPECT_EQ(lumen.anatomy.branches.size(), branches);
}

void expect_refused(const TriangleMesh& mesh, const std::string& found, const std::string& accepted,
                    const ImportOptions& options = millimetres()) {
    const std::string text = refusal([&] { imported(mesh, options); });
    test::expect_said(text, found);
    test::expect_said(text, accepted);
}

TriangleMesh scaled(TriangleMesh mesh, double factor) {
    for (Vec3& v : mesh.vertices) v *= factor;
    return mesh;
}

}  // namespace

TEST(LumenImport, FindsTheBranchesItWasMadeFrom) {
    const ImportedLumen lumen = imported(test::small_anatomy().lumen);
    const studies::ImportErrors errors = studies::import_errors(test::small_anatomy(), lumen.anatomy);
    EXPECT_EQ(errors.branches, 2);
    EXPECT_EQ(errors.invented, 0);
    EXPECT_EQ(errors.ends, 3);
    EXPECT_LE(errors.centre_p95, 0.1);
    EXPECT_LE(errors.radius_p95, 0.1);
    const Anatomy& anatomy = lumen.anatomy;
    EXPECT_EQ(anatomy.ends[0].opening.name, "END1");
    EXPECT_EQ(anatomy.ends[0].role, EndRole::Inlet);
    EXPECT_EQ(anatomy.branches[1].name, "B2");
    EXPECT_EQ(anatomy.branches[1].parent, 0);
    for (const Check& check : lumen.checks) EXPECT_EQ(check.verdict, Check::Verdict::Pass) << text_of(check);

    ImportOptions alone = millimetres();
    alone.threads = 1;
    alone.inlet = Vec3(29, 0, 0);
    const Anatomy other = imported(test::small_anatomy().lumen, alone).anatomy;
    EXPECT_NEAR(other.ends[0].opening.centre.x(), 30, 1);
    alone.inlet.reset();
    const Anatomy again = imported(test::small_anatomy().lumen, alone).anatomy;
    for (std::size_t b = 0; b < 2; ++b) {
        EXPECT_EQ(again.branches[b].points, anatomy.branches[b].points);
        EXPECT_EQ(again.branches[b].radii, anatomy.branches[b].radii);
    }
    EXPECT_EQ(again.lumen.triangles, anatomy.lumen.triangles);
}

TEST(LumenImport, MendsACorruptedMeshAndGivesADistanceField) {
    const test::TemporaryFolder folder;
    const ImportedLumen lumen = imported(studies::corrupted(test::small_anatomy().lumen, 7));
    EXPECT_TRUE(reports(lumen, "holes were filled"));
    EXPECT_TRUE(reports(lumen, "were turned outward"));
    const Anatomy read = load_anatomy(write_anatomy(lumen.anatomy, folder.path(), {}));
    const studies::ImportErrors errors = studies::import_errors(test::small_anatomy(), read);
    EXPECT_EQ(errors.branches, 2);
    EXPECT_EQ(errors.invented, 0);
    EXPECT_EQ(errors.ends, 3);
    EXPECT_LE(errors.centre_p95, 0.1);
    EXPECT_LE(errors.radius_p95, 0.2);
    physics::DistanceFieldOptions coarse;
    coarse.spacing = 0.3;
    const physics::DistanceField field(read.lumen, read.branches, read.openings(), 5, 0, coarse);
    const std::vector<Vec3> joints = {{5, 0, 2.4}, {5, 0, 1.7}};
    std::vector<physics::WallContact> contacts(2);
    field.contacts(joints, contacts);
    EXPECT_NEAR(contacts[0].penetration, 0.4, 0.1);
    EXPECT_LT(contacts[1].penetration, 0);
}

TEST(LumenImport, TakesOffFlatCaps) {
    const Anatomy& truth = test::small_anatomy();
    const TriangleMesh closed = studies::flat_capped(truth.lumen);
    for (const TriangleMesh& mesh : {closed, studies::corrupted(closed, 5)}) {
        const ImportedLumen lumen = imported(mesh);
        EXPECT_TRUE(reports(lumen, "3 flat caps were taken off"));
        const studies::ImportErrors errors = studies::import_errors(truth, lumen.anatomy);
        EXPECT_EQ(errors.branches, 2);
        EXPECT_EQ(errors.ends, 3);
        EXPECT_EQ(lumen.anatomy.ends.size(), 3u);
        EXPECT_LE(errors.end_centre, 0.2);
        EXPECT_LE(errors.end_radius, 0.05);
        EXPECT_LE(errors.end_normal, 5 * geometry::degree);
    }
}

TEST(LumenImport, CutsALumenWithDomesOpenAtItsTips) {
    VesselTreeSpec spec = test::small_tree();
    for (BranchSpec& branch : spec.branches) branch.closed = true;
    const Anatomy domes = generate(spec);
    ASSERT_EQ(domes.ends.size(), 1u);
    const ImportedLumen lumen = imported(domes.lumen);
    EXPECT_TRUE(reports(lumen, "ends are missing: 2 blind tips were cut open"));
    expect_parts(lumen, 3, 2);
    EXPECT_LT(studies::nearest_on(lumen.anatomy.branches, {20, 0, 0}).distance, 0.1);
    for (const Check& check : lumen.checks) EXPECT_EQ(check.verdict, Check::Verdict::Pass) << text_of(check);

    ImportOptions one = millimetres();
    one.ends = {Vec3(31, 0, 0)};
    const ImportedLumen other = imported(domes.lumen, one);
    EXPECT_EQ(other.anatomy.ends.size(), 2u);
    EXPECT_TRUE(reports(other, "1 branch ends blind; --end X,Y,Z cuts one open"));
    one.ends = {Vec3(10, 30, 0)};
    expect_refused(domes.lumen, "--end (10.00, 30.00, 0.00): no blind tip is near", "expected one of these",
                   one);
}

TEST(LumenImport, TheInletIsWhereItIsGivenOrRefused) {
    VesselTreeSpec spec = test::small_tree();
    spec.branches[1].closed = true;
    const Anatomy half = generate(spec);
    ImportOptions options = millimetres();
    options.inlet = half.branches[1].points.back();
    const ImportedLumen lumen = imported(half.lumen, options);
    EXPECT_EQ(lumen.anatomy.ends.size(), 3u);
    EXPECT_LT((lumen.anatomy.ends[0].opening.centre - *options.inlet).norm(), 2);
    options.inlet = Vec3(0, 60, 0);
    expect_refused(half.lumen, "--inlet (0.00, 60.00, 0.00): the nearest end is",
                   "expected a place at one of these", options);
    expect_refused(test::small_anatomy().lumen, "--inlet (0.00, 60.00, 0.00): the nearest end is",
                   "expected a place at one of these", options);
}

TEST(LumenImport, FollowsUpToFiveHundredTips) {
    VesselTreeSpec spec;
    spec.name = "comb";
    spec.branches = {{"main", "", 0, {{{0, 0, 0}, 2}, {{260, 0, 0}, 2}}, false}};
    for (int k = 0; k < 80; ++k) {
        const double side = k % 2 == 0 ? 1 : -1;
        spec.branches.push_back({fmt::format("side {}", k),
                                 "main",
                                 6 + 3.1 * k,
                                 {{{0, 0, 0}, 0.7}, {{0, 8 * side, 0.3}, 0.6}},
                                 true});
    }
    const ImportedLumen lumen = imported(generate(spec).lumen);
    expect_parts(lumen, 2, 81);
    EXPECT_TRUE(reports(lumen, "80 branches end blind"));
}

TEST(LumenImport, PrunesWhatNoWireCanEnter) {
    VesselTreeSpec spec = test::small_tree();
    spec.branches.push_back(
        {"thin", "main", 20, {{{0, 0, 0}, 0.5}, {{0, -5, 0}, 0.4}, {{0, -14, 0}, 0.4}}, false});
    spec.stenoses = {{"thin", 8, 4, 75}};
    const Anatomy truth = generate(spec);
    ASSERT_EQ(truth.ends.size(), 4u);
    const ImportedLumen lumen = imported(truth.lumen);
    expect_parts(lumen, 3, 3);
    EXPECT_TRUE(reports(lumen, "of vessels thinner than 0.178 mm"));
    EXPECT_TRUE(problems(lumen.anatomy).empty());
}

TEST(LumenImport, AFlatVesselIsOneBranch) {
    TriangleMesh vein = tube(2, 60, 48);
    for (Vec3& v : vein.vertices) v.y() *= 4;
    for (const TriangleMesh& mesh : {vein, studies::flat_capped(vein)}) {
        const ImportedLumen lumen = imported(mesh);
        expect_parts(lumen, 2, 1);
    }
}

TEST(LumenImport, AHelixIsNoWall) {
    // Turns a millimetre apart: a ray from one passes through all others.
    const std::vector<PenMove> turns = {Arc{9, 8 * std::numbers::pi, Vec3(0.1, 0, 1).normalized()}};
    const ImportedLumen lumen = imported(tube_anatomy("helix", draw(turns), 2.2, 24, 1).lumen);
    expect_parts(lumen, 2, 1);
}

TEST(LumenImport, RefusesABall) {
    TriangleMesh ball = tube(1, 2, 32);
    ball = geometry::capped(ball, geometry::topology(ball).loops);
    for (Vec3& v : ball.vertices) v = 8 * (v - Vec3(1, 0, 0)).normalized();
    expect_refused(ball, "a ball, not a vessel", "times as long as wide");
}

TEST(LumenImport, FollowsASacThatHasNoEnd) {
    VesselTreeSpec spec = test::small_tree();
    spec.aneurysms = {{"main", 22, 6, 3, 3}};
    const ImportedLumen lumen = imported(generate(spec).lumen);
    expect_parts(lumen, 3, 3);
    EXPECT_TRUE(reports(lumen, "1 branch ends blind"));
}

TEST(LumenImport, ASacWiderThanItsVesselStaysClosed) {
    // A long one and a round one of 8 mm, on a neck, and one on a broad neck.
    const std::vector<VesselKnot> stretched = {
        {{0, 0, 0}, 1.2}, {{0, -4, 0}, 1.2}, {{0, -8, 0}, 4}, {{0, -11, 0}, 4}, {{0, -13, 0}, 3.6}};
    const std::vector<VesselKnot> on_neck = {
        {{0, 0, 0}, 1.2}, {{0, -4, 0}, 1.2}, {{0, -7, 0}, 3.4}, {{0, -9, 0}, 4}, {{0, -11, 0}, 3.6}};
    const std::vector<VesselKnot> broad = {
        {{0, 0, 0}, 1.5}, {{0, -3.4, 0}, 1.5}, {{0, -6.4, 0}, 3.7}, {{0, -8, 0}, 3.7}};
    for (const auto& knots : {stretched, on_neck, broad}) {
        VesselTreeSpec spec = test::small_tree();
        spec.branches.push_back({"sac", "main", 22, knots, true});
        const TriangleMesh open = generate(spec).lumen;
        const ImportedLumen lumen = imported(open);
        expect_parts(lumen, 3, 3);
        EXPECT_EQ(lumen.anatomy.lumen.triangles.size(), open.triangles.size());
        EXPECT_TRUE(reports(lumen, "1 blind tip is a sac, not the end of a tube, and stays closed"));
        // The same where the vessels' ends are missing: they are opened, the sac is not.
        for (BranchSpec& branch : spec.branches) branch.closed = true;
        const Anatomy closed = generate(spec);
        const ImportedLumen domes = imported(closed.lumen);
        EXPECT_TRUE(reports(domes, "ends are missing: 2 blind tips were cut open"));
        EXPECT_TRUE(reports(domes, "1 blind tip is a sac, not the end of a tube, and stays closed"));
        EXPECT_EQ(domes.anatomy.ends.size(), 3u);
        // The user may open it.
        ImportOptions options = millimetres();
        options.ends = {closed.branches[2].points.back()};
        const ImportedLumen asked = imported(open, options);
        EXPECT_EQ(asked.anatomy.ends.size(), 4u);
        EXPECT_FALSE(reports(asked, "is a sac"));
    }
}

TEST(LumenImport, UsesGivenCentrelines) {
    const test::TemporaryFolder folder;
    test::write(folder / "lines.csv",
                "branch,x_mm,y_mm,z_mm\nmain,1,0,0\nmain,15,0.3,0\nmain,29,0,0\nside,12,0,0\nside,15,4,"
                "0\nside,20,11,2\n");
    ImportOptions options = millimetres();
    options.centrelines = {folder / "lines.csv"};
    const ImportedLumen lumen = imported(test::small_anatomy().lumen, options);
    EXPECT_TRUE(reports(lumen, "the centrelines are 2 lines of lines.csv"));
    const studies::ImportErrors errors = studies::import_errors(test::small_anatomy(), lumen.anatomy);
    EXPECT_EQ(errors.branches, 2);
    EXPECT_EQ(errors.invented, 0);
    EXPECT_LE(errors.centre_p95, 0.1);
}

TEST(LumenImport, FindsTheWaysThatGivenCentrelinesLeaveOut) {
    const test::TemporaryFolder folder;
    for (const auto& [line, last] : {std::pair("main,1,0,0\nmain,15,0.3,0\nmain,29,0,0\n", "main"),
                                     std::pair("side,12,0,0\nside,15,4,0\nside,20,11,2\n", "side")}) {
        test::write(folder / "lines.csv", std::string("branch,x_mm,y_mm,z_mm\n") + line);
        ImportOptions options = millimetres();
        options.centrelines = {folder / "lines.csv"};
        const ImportedLumen lumen = imported(test::small_anatomy().lumen, options);
        EXPECT_TRUE(reports(lumen, "the centrelines lead to 1 of 2 ends; the ways to the others were found"))
            << last;
        EXPECT_TRUE(std::ranges::any_of(lumen.anatomy.branches, [&](const auto& branch) {
            return branch.name == last;
        })) << last;
        const studies::ImportErrors errors = studies::import_errors(test::small_anatomy(), lumen.anatomy);
        EXPECT_EQ(errors.branches, 2);
        EXPECT_EQ(errors.invented, 0);
        EXPECT_LE(errors.centre_p95, 0.1);
    }
}

TEST(LumenImport, RefusesAWrongUnitWithTheOneThatFits) {
    ImportOptions options;
    const TriangleMesh mesh = tube(2, 20);
    const test::TemporaryFolder folder;
    test::write(folder / "mesh.obj", "v 0 0 0\n");
    test::expect_refusal([&] { import_lumen(folder / "mesh.obj", options); }, "expected --unit mm, cm or m");
    options.unit = "inch";
    test::expect_refusal([&] { import_lumen(folder / "mesh.obj", options); }, "unit 'inch' was given");
    expect_refused(scaled(mesh, 0.001), "median radius: 0.00199 mm was found",
                   "(--unit m would make it 2 mm)");
    options.unit = "cm";
    expect_refused(scaled(mesh, 20), "median radius: 39.8", "--unit mm would make it 4 mm", options);
}

TEST(LumenImport, RefusesTheWallOfAVesselInPlaceOfItsLumen) {
    TriangleMesh wall = tube(2, 20), inner = tube(1.5, 20);
    const int around = 24, outer_last = static_cast<int>(wall.vertices.size()) - around;
    for (auto& t : inner.triangles) std::swap(t[0], t[1]);
    const int first = static_cast<int>(wall.vertices.size());
    const int inner_last = static_cast<int>(inner.vertices.size()) - around;
    // Rims that join the two tubes, so that the surface is closed as a printed phantom's is.
    const bool same_phase = (outer_last / around) % 2 == (inner_last / around) % 2;
    ASSERT_TRUE(same_phase);
    test::append(wall, inner);
    for (int k = 0; k < around; ++k) {
        const int n = (k + 1) % around;
        wall.triangles.push_back({k, first + k, n});
        wall.triangles.push_back({n, first + k, first + n});
        wall.triangles.push_back({outer_last + k, outer_last + n, first + inner_last + k});
        wall.triangles.push_back({outer_last + n, first + inner_last + n, first + inner_last + k});
    }
    expect_refused(wall, "surface that looks into a tube", "not a lumen: give its inner surface");
}

TEST(LumenImport, RefusesAMeshTooCoarse) {
    expect_refused(tube(2, 40, 3), "median edge", "centrelines beside it (--centrelines)");
}

TEST(LumenImport, RefusesALumenNarrowerThanTheThinnestWire) {
    TriangleMesh mesh = tube(1, 30, 32);
    for (Vec3& v : mesh.vertices) {
        const double narrow = 1 - 0.9 * std::exp(-std::pow((v.x() - 15) / 3, 2));
        v.y() *= narrow, v.z() *= narrow;
    }
    expect_refused(mesh, "leave no way from one end to another", "expected a lumen that a wire can pass");
}

TEST(LumenImport, RefusesWhatIsNotMadeOfTubes) {
    // A tube with more bulges than a tree has.
    TriangleMesh comb = tube(1.5, 260, 12);
    std::vector<Vec3> corners;
    for (std::size_t v = 0; v < comb.vertices.size(); ++v) {
        Vec3& p = comb.vertices[v];
        const int ring = static_cast<int>(v) / 12;
        if (ring % 6 >= 4 && p.y() > 0.5) p.y() += 2;
    }
    const std::string text = refusal([&] { imported(comb); });
    test::expect_said(text, "bulges shorter than two radii were found");
    test::expect_said(text, "--centrelines");
}

TEST(LumenImport, RefusesEndsThatNoWayLeadsTo) {
    // Two tubes that only a flat web joins.
    TriangleMesh mesh = tube(1, 12, 16);
    for (Vec3& v : mesh.vertices)
        if (std::abs(v.x() - 6) < 1) v.y() *= 0.002;
    expect_refused(mesh, "no way through the lumen leads from the inlet at (",
                   "expected a lumen in one piece");
}

using GivenCentrelines = test::InFolder;

TEST_F(GivenCentrelines, SayWhatIsAccepted) {
    const auto text_for = [&](const std::string& name, const std::string& content) {
        test::write(folder / name, content);
        return refusal([&] { load_centrelines(folder / name, 1); });
    };
    test::expect_said(text_for("a.csv", "x,y,z\n"), "a.csv:1: 'x,y,z' was found");
    test::expect_said(text_for("a.csv", "branch,x_mm,y_mm,z_mm\nb,0,0,nan\n"), "a.csv:2:");
    test::expect_said(text_for("a.json", "[1]"), "not a JSON object");
    test::expect_said(text_for("a.json", "{\"b\":[[0,0,0],[1,\"x\",0]]}"), "'b', point 1");
    test::expect_said(text_for("a.json", "{}"), "no line of two points");
    test::expect_said(text_for("a.json", "{}"), "branch,x_mm,y_mm,z_mm[,r_mm], VTK PolyData");
    test::write(folder / "b.json", "{\"b\":[[0,0,0,1],[1,2,0,1]]}");
    EXPECT_EQ(load_centrelines(folder / "b.json", 10).lines[0].points[1], Vec3(10, 20, 0));
}

TEST(AnatomyCheck, NamesWhatFails) {
    Anatomy anatomy = test::small_anatomy();
    anatomy.branches[1].points[20] += Vec3(0, 0, 3);
    anatomy.branches[0].radii[18] = 3;
    anatomy.branches[0].radii[15] = 0.1;
    std::string failed;
    for (const Check& check : anatomy_checks(anatomy))
        if (check.verdict != Check::Verdict::Pass) failed += text_of(check) + "\n";
    test::expect_said(failed, "FAIL  centreline samples outside the lumen: 1 of");
    test::expect_said(failed, "FAIL  smallest radius: 0.100 mm in main, sample 15");
    test::expect_said(failed, "note  radius over the distance to the wall: 1.5");
    Anatomy pierced = test::small_anatomy();
    for (Vec3& v : pierced.lumen.vertices) {
        if ((v - Vec3(24, 2, 0)).norm() > 0.7) continue;
        v.y() = -2.6;
        break;
    }
    failed.clear();
    for (const Check& check : anatomy_checks(pierced))
        if (check.verdict == Check::Verdict::Warning) failed += text_of(check) + "\n";
    test::expect_said(failed, "note  triangles that cross: ");
    test::expect_said(failed, " pairs, the first at (2");
}

}  // namespace anatomy
