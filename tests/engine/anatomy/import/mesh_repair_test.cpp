#include "engine/anatomy/import/mesh_repair.h"

#include <algorithm>

#include "tests/engine/anatomy/tubes.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using test::tube;

bool reports(const RepairedLumen& lumen, const std::string& text) {
    return std::any_of(lumen.findings.begin(), lumen.findings.end(),
                       [&](const Finding& f) { return f.text.find(text) != std::string::npos; });
}

void expect_whole(const RepairedLumen& lumen, std::size_t triangles) {
    const geometry::Topology found = geometry::topology(lumen.mesh);
    EXPECT_EQ(lumen.mesh.triangles.size(), triangles);
    EXPECT_EQ(found.non_manifold_edges, 0);
    EXPECT_EQ(found.loops.size(), 2u);
    EXPECT_EQ(lumen.ends.size(), 2u);
    EXPECT_GT(geometry::signed_volume(geometry::capped(lumen.mesh, found.loops)), 0);
}

}  // namespace

TEST(MeshRepair, LeavesATidyTubeAsItIs) {
    const TriangleMesh mesh = tube(2, 20);
    const RepairedLumen lumen = repaired(mesh);
    EXPECT_TRUE(lumen.findings.empty());
    expect_whole(lumen, mesh.triangles.size());
    for (const MeshOpening& end : lumen.ends) {
        EXPECT_NEAR(end.radius, 2, 0.02);
        EXPECT_NEAR(std::abs(end.normal.x()), 1, 1e-6);
        EXPECT_EQ(end.normal.x() > 0, end.loop.centroid.x() > 10);
    }
}

TEST(MeshRepair, TurnsTrianglesOutward) {
    TriangleMesh mesh = tube(2, 20);
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
    EXPECT_TRUE(reports(repaired(mesh), "all triangles faced into the lumen"));
    for (std::size_t i = 7; i < mesh.triangles.size(); i += 20)
        std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
    const RepairedLumen lumen = repaired(mesh);
    EXPECT_TRUE(reports(lumen, "were turned outward"));
    expect_whole(lumen, mesh.triangles.size());
}

TEST(MeshRepair, WeldsCornersThatNearlyMeet) {
    TriangleMesh mesh = tube(2, 20);
    const int corner = mesh.triangles[200][0];
    mesh.vertices.push_back(mesh.vertices[corner] + Vec3::Constant(3e-6));
    mesh.triangles[200][0] = static_cast<int>(mesh.vertices.size()) - 1;
    const RepairedLumen lumen = repaired(mesh);
    EXPECT_TRUE(reports(lumen, "1 corners within"));
    expect_whole(lumen, mesh.triangles.size());
}

TEST(MeshRepair, DropsDoublesFinsAndIslands) {
    TriangleMesh mesh = tube(2, 20);
    const std::size_t whole = mesh.triangles.size();
    const auto t = mesh.triangles[100];
    mesh.triangles.push_back({t[1], t[0], t[2]});
    mesh.vertices.push_back({5, 0, 4});
    mesh.triangles.push_back({t[0], t[1], static_cast<int>(mesh.vertices.size()) - 1});
    TriangleMesh island = tube(0.1, 1, 6);
    for (Vec3& v : island.vertices) v += Vec3(0, 9, 0);
    test::append(mesh, island);
    const RepairedLumen lumen = repaired(mesh);
    EXPECT_TRUE(reports(lumen, "1 double triangles"));
    EXPECT_TRUE(reports(lumen, "1 edges of three or more triangles"));
    EXPECT_TRUE(reports(lumen, "1 pieces apart from the vessel"));
    expect_whole(lumen, whole);
}

TEST(MeshRepair, RefusesPiecesThatAreNoSpecks) {
    TriangleMesh wall = tube(4, 20);
    test::append(wall, tube(3, 20));  // the inside of the wall
    const std::string text = test::refusal([&] { repaired(wall); });
    test::expect_said(text, "in pieces apart, one of them");
    test::expect_said(text, "one lumen");
}

TEST(MeshRepair, FillsHolesAndListsThem) {
    TriangleMesh mesh = tube(2, 20);
    const std::size_t whole = mesh.triangles.size();
    const Vec3 place = mesh.vertices[mesh.triangles[500][0]];
    std::erase_if(mesh.triangles, [&](const auto& t) {
        return std::any_of(t.begin(), t.end(),
                           [&](int v) { return (mesh.vertices[v] - place).norm() < 0.6; });
    });
    ASSERT_LT(mesh.triangles.size(), whole - 10);
    mesh.triangles.erase(mesh.triangles.begin() + 150);
    const RepairedLumen lumen = repaired(mesh);
    EXPECT_TRUE(reports(lumen, "2 holes were filled"));
    EXPECT_EQ(geometry::topology(lumen.mesh).boundary_edges, 48);
    EXPECT_EQ(lumen.ends.size(), 2u);
}

TEST(MeshRepair, FillsHolesThatShareACorner) {
    TriangleMesh mesh = tube(2, 20);
    const std::size_t whole = mesh.triangles.size();
    const auto first = mesh.triangles[200];
    for (std::size_t i = 210; i < whole; ++i) {
        const auto& t = mesh.triangles[i];
        const auto shared = std::count_if(t.begin(), t.end(), [&](int v) {
            return std::find(first.begin(), first.end(), v) != first.end();
        });
        if (shared != 1) continue;
        mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(i));
        break;
    }
    mesh.triangles.erase(mesh.triangles.begin() + 200);
    ASSERT_EQ(mesh.triangles.size(), whole - 2);
    expect_whole(repaired(mesh), whole);
}

TEST(MeshRepair, RefusesASurfaceWithOneSideOnly) {
    TriangleMesh band;
    for (int i = 0; i < 12; ++i) {
        const double turn = 2 * std::numbers::pi * i / 12;
        const Vec3 out(std::cos(turn), std::sin(turn), 0);
        const Vec3 across = std::cos(turn / 2) * out + std::sin(turn / 2) * Vec3::UnitZ();
        band.vertices.push_back(5 * out + across);
        band.vertices.push_back(5 * out - across);
    }
    for (int i = 0; i < 12; ++i) {
        const int a = 2 * i, b = 2 * i + 1, c = i < 11 ? a + 2 : 1, d = i < 11 ? b + 2 : 0;
        band.triangles.push_back({a, c, b});
        band.triangles.push_back({b, c, d});
    }
    const std::string text = test::refusal([&] { repaired(band); });
    test::expect_said(text, "Möbius");
    test::expect_said(text, "expected a surface with two sides");
}

TEST(MeshRepair, RefusesATriangle) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    test::expect_refusal([&] { repaired(mesh); }, "1 triangle was found");
}

}  // namespace anatomy
