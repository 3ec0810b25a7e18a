/// Rims of meshes that lie in no plane: the wall goes on to the end's plane and past it.

#include "physics/wall/even_rims.h"

#include <cmath>
#include <gtest/gtest.h>

#include "engine/anatomy/anatomy.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"
#include "tests/physics/wires.h"

using namespace physics;

namespace {

/// A tube of 2 mm radius whose rim at one end waves by 0.4 mm to both sides of its plane.
anatomy::Anatomy waving_tube() {
    anatomy::Anatomy tube = anatomy::tube_anatomy("waves", {{0, 0, 0}, {40, 0, 0}}, 2.0, 96, 1.0);
    for (Vec3& corner : tube.lumen.vertices)
        if (corner.x() > 39.9) corner.x() -= 0.4 * (1 + std::cos(3 * std::atan2(corner.y(), corner.z())));
    for (anatomy::VesselEnd& end : tube.ends)
        if (end.opening.centre.x() > 39) end.opening.centre.x() = 39.6;
    return tube;
}

}  // namespace

TEST(EvenRims, WallsOfFieldAndMeshGoOnToThePlane) {
    const anatomy::Anatomy tube = waving_tube();
    const DistanceField field(tube.lumen, tube.branches, tube.openings(), 20, 0.18);
    const MeshWall mesh(tube.lumen, tube.branches, tube.openings(), 20, 0.18);
    for (const LumenWall* wall :
         {static_cast<const LumenWall*>(&field), static_cast<const LumenWall*>(&mesh)})
        for (double angle = 0; angle < 6.2; angle += 0.1)
            for (double x = 38; x < 41.6; x += 0.05) {
                // The vessel past the end narrows by 0.06 on a millimetre.
                const double aside = 1.9;
                const WallContact c = ask(*wall, {x, aside * std::cos(angle), aside * std::sin(angle)});
                const double narrower = 0.08 * std::max(0.0, x - 39.6);
                EXPECT_NEAR(c.penetration, aside + 0.18 - 2 + 0.5 * narrower, 0.03 + 0.5 * narrower)
                    << x << ", " << angle;
            }
}

TEST(EvenRims, ARimInItsPlaneIsLeftAsItIs) {
    const anatomy::Anatomy even = anatomy::tube_anatomy("even", {{0, 0, 0}, {40, 0, 0}}, 2.0, 96, 1.0);
    EXPECT_EQ(with_even_rims(even.lumen, even.openings()).triangles, even.lumen.triangles);
    const anatomy::Anatomy tube = waving_tube();
    const TriangleMesh led = with_even_rims(tube.lumen, tube.openings());
    EXPECT_EQ(led.triangles.size(), tube.lumen.triangles.size() + 2 * 96);
    const Topology edges = topology(led);
    EXPECT_EQ(edges.loops.size(), 2u);
    EXPECT_EQ(edges.non_manifold_edges, 0);
    for (const BoundaryLoop& rim : edges.loops)
        for (const int v : rim.vertices)
            EXPECT_TRUE(led.vertices[v].x() < 0.1 || led.vertices[v].x() > 40.5)
                << led.vertices[v].transpose();
}
