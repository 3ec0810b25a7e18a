#include "physics/wall/mesh_wall.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/scenes.h"
#include "physics/relax/relaxer.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"
#include "tests/physics/wires.h"

using namespace physics;

TEST(MeshWall, AgreesWithTubeWallOnAFinelyTessellatedTube) {
    const Polyline centreline = anatomy::draw(anatomy::find_scene("spatial")->path);
    const anatomy::Anatomy anatomy = anatomy::tube_anatomy("spatial", centreline, 2.0, 128, 0.3);
    const MeshWall mesh(anatomy.lumen, anatomy.branches, anatomy.openings(), 42.0, 0.3);
    const TubeWall tube(centreline, 2.0, 42.0, 0.3);
    int touching = 0;
    for (std::size_t i = 200; i + 200 < centreline.size(); i += 37) {
        const Vec3 along = (centreline[i + 1] - centreline[i]).normalized();
        Vec3 a, b;
        tangent_basis(along, a, b);
        for (double angle = 0; angle < 6.2; angle += 0.7)
            for (double r : {0.4, 1.5, 1.72, 1.9, 2.3}) {
                const Vec3 x = centreline[i] + r * (std::cos(angle) * a + std::sin(angle) * b);
                const WallContact m = ask(mesh, x), t = ask(tube, x);
                EXPECT_EQ(m.touches(), t.touches()) << x.transpose();
                if (!t.touches()) continue;
                ++touching;
                // Facets of 128 and chords of 0.3 mm lie within about 0.01 mm of the tube.
                EXPECT_NEAR(m.penetration, t.penetration, 0.02);
                EXPECT_GT(m.normal.dot(t.normal), std::cos(0.12));
            }
    }
    EXPECT_GT(touching, 500);
}

namespace {

/// The wall of the iliac arteries and the aorta.
const MeshWall& iliac_wall() {
    static const anatomy::Anatomy& vessels = test::iliac_renal();
    static const MeshWall wall(vessels.lumen, vessels.branches, vessels.openings(), 20.0, 0.4);
    return wall;
}

}  // namespace

TEST(MeshWall, TheVesselGoesOnRoundAndNarrowingPastAnOpenEnd) {
    const MeshWall& wall = iliac_wall();
    for (const OpenEnd& end : test::iliac_renal().openings()) {
        const int station = ask(wall, end.centre).station;
        const double narrows =
            (end.radius - 0.3 - 0.375 * std::min(0.5, 0.25 * end.radius)) / (14 * end.radius);
        for (const double out : {0.5, 2.0, 13.0})
            for (const double aside : {0.3, 0.5, 1.2}) {
                Vec3 a, b;
                tangent_basis(end.outward_normal, a, b);
                const Vec3 x = end.centre + end.radius * (out * end.outward_normal + aside * a);
                EXPECT_NEAR(ask(wall, x, station).penetration,
                            (aside - 1 + narrows * (out - 0.125)) * end.radius + 0.4, 1e-9)
                    << end.name << " " << out << " " << aside;
            }
    }
}

TEST(MeshWall, PutsAJointInTheBranchThatHoldsIt) {
    const MeshWall& wall = iliac_wall();
    for (std::size_t b = 0; b < test::iliac_renal().branches.size(); ++b) {
        const auto& branch = test::iliac_renal().branches[b];
        const std::size_t i = branch.points.size() * 3 / 4;
        const WallContact c = ask(wall, branch.points[i] + Vec3(0.3, 0.2, 0.1));
        EXPECT_EQ(wall.place(c.station).branch, static_cast<int>(b)) << branch.name;
        EXPECT_FALSE(c.touches());
    }
}

TEST(MeshWall, FollowsAJointFromTheAortaIntoTheRenalArteryAndBack) {
    const MeshWall& wall = iliac_wall();
    const auto lra = std::find_if(test::iliac_renal().branches.begin(), test::iliac_renal().branches.end(),
                                  [](const auto& b) { return b.name == "LRA"; });
    ASSERT_NE(lra, test::iliac_renal().branches.end());
    int station = ask(wall, lra->points[0]).station;
    EXPECT_NE(test::iliac_renal().branches[wall.place(station).branch].name, "LRA");
    for (const Vec3& x : lra->points) {
        const WallContact c = ask(wall, x, station);
        EXPECT_FALSE(c.touches()) << x.transpose();
        station = c.station;
    }
    EXPECT_EQ(test::iliac_renal().branches[wall.place(station).branch].name, "LRA");
    for (auto x = lra->points.rbegin(); x != lra->points.rend(); ++x)
        station = ask(wall, *x, station).station;
    EXPECT_NE(test::iliac_renal().branches[wall.place(station).branch].name, "LRA");
}

TEST(MeshWall, NoJointInsideTheBallsOfTheCentrelineTouches) {
    const MeshWall& wall = iliac_wall();
    const auto& branches = test::iliac_renal().branches;
    for (const auto& branch : branches)
        for (std::size_t i = 5; i + 5 < branch.points.size(); i += 3) {
            // At a carina the plane of a facet runs on into the vessel beside it.
            const auto nearby = [&](const auto& other) {
                for (std::size_t k = 0; &other != &branch && k < other.points.size(); ++k)
                    if ((other.points[k] - branch.points[i]).norm() < other.radii[k] + branch.radii[i])
                        return true;
                return false;
            };
            const double deepest = std::any_of(branches.begin(), branches.end(), nearby) ? 0.2 : 0.05;
            Vec3 a, b;
            tangent_basis((branch.points[i + 1] - branch.points[i]).normalized(), a, b);
            for (const Vec3& way : {a, b, Vec3(-a), Vec3(-b)}) {
                const Vec3 x = branch.points[i] + (branch.radii[i] - 0.4 - 0.15) * way;
                const WallContact c = ask(wall, x);
                EXPECT_LT(c.penetration, deepest) << branch.name << " " << i;
            }
        }
}

TEST(MeshWall, RefusesAMeshThatIsNone) {
    const CentrelineBranch line{"tube", -1, -1, {{0, 0, 0}, {1, 0, 0}}, {1, 1}};
    EXPECT_THROW(MeshWall({}, {line}, {}, 20), std::invalid_argument);
    TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
    EXPECT_NO_THROW(MeshWall(mesh, {line}, {}, 20));
    EXPECT_THROW(MeshWall(mesh, {}, {}, 20), std::invalid_argument);
    EXPECT_THROW(MeshWall(mesh, {line}, {}, -1), std::invalid_argument);
    mesh.triangles.push_back({0, 1, 3});
    EXPECT_THROW(MeshWall(mesh, {line}, {}, 20), std::invalid_argument);
    mesh.triangles.pop_back();
    mesh.vertices[1].x() = std::nan("");
    EXPECT_THROW(MeshWall(mesh, {line}, {}, 20), std::invalid_argument);
}
