#include "render/patient/signed_distance.h"

#include <gtest/gtest.h>
#include <numbers>
#include <utility>

#include "physics/geometry/mesh_topology.h"
#include "render/xray/path_length.h"

namespace {

using geometry::Vec3;
namespace shape = render::shape;

double volume_of_ball(double radius) {
    return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
}

TEST(SignedDistance, BallIsClosedAndOfTheRightSize) {
    shape::Compound ball;
    ball.add(shape::ball(Vec3(3, -2, 7), 20.0), 2.0);
    const shape::Surfaces made = shape::polygonised(ball, 2.0);
    EXPECT_EQ(render::unmatched_edges(made.outer), 0);
    EXPECT_EQ(render::unmatched_edges(made.core), 0);
    // Triangles are chords: they lie inside by up to 0.15 mm.
    for (const auto& [mesh, radius] : {std::pair{&made.outer, 20.0}, {&made.core, 18.0}}) {
        const double volume = geometry::signed_volume(*mesh);
        EXPECT_LT(volume, volume_of_ball(radius));
        EXPECT_GT(volume, volume_of_ball(radius - 0.15));
    }
    // Vertices lie on the surface, also where cells were merged.
    for (const Vec3& v : made.outer.vertices) EXPECT_NEAR((v - Vec3(3, -2, 7)).norm(), 20.0, 0.05);
    for (const Vec3& v : made.core.vertices) EXPECT_NEAR((v - Vec3(3, -2, 7)).norm(), 18.0, 0.05);
}

TEST(SignedDistance, UnionCountsOnce) {
    // Two balls whose middles are a radius apart: a lens of 5/16 of a ball is common to both.
    shape::Compound both;
    both.add(shape::ball(Vec3(0, 0, 0), 16.0)).add(shape::ball(Vec3(16, 0, 0), 16.0));
    const geometry::TriangleMesh mesh = shape::polygonised(both, 1.5).outer;
    EXPECT_EQ(render::unmatched_edges(mesh), 0);
    EXPECT_NO_THROW(render::require_simple("balls", mesh));
    EXPECT_NEAR(geometry::signed_volume(mesh) / ((2.0 - 5.0 / 16.0) * volume_of_ball(16.0)), 1.0, 0.01);
}

TEST(SignedDistance, CutAndKeepTakeAway) {
    shape::Compound half;
    half.add(shape::ball(Vec3::Zero(), 16.0)).keep(shape::half_space(Vec3::Zero(), Vec3::UnitX()));
    EXPECT_NEAR(geometry::signed_volume(shape::polygonised(half, 1.5).outer) / volume_of_ball(16.0), 0.5,
                0.01);
    shape::Compound hollow;
    hollow.add(shape::ball(Vec3::Zero(), 16.0)).cut(shape::ball(Vec3::Zero(), 12.0));
    const geometry::TriangleMesh shell = shape::polygonised(hollow, 1.5).outer;
    EXPECT_EQ(render::unmatched_edges(shell), 0);
    EXPECT_NEAR(geometry::signed_volume(shell) / (volume_of_ball(16.0) - volume_of_ball(12.0)), 1.0, 0.02);
}

TEST(SignedDistance, SolidsHaveTheirVolumes) {
    const auto volume = [](const shape::Solid& solid) {
        shape::Compound one;
        one.add(solid);
        return geometry::signed_volume(shape::polygonised(one, 1.0).outer);
    };
    EXPECT_NEAR(
        volume(shape::ellipsoid(Vec3::Zero(), Vec3(8, 12, 20))) / (4.0 / 3.0 * std::numbers::pi * 1920.0),
        1.0, 0.02);
    EXPECT_NEAR(volume(shape::block(Vec3::Zero(), Vec3(8, 12, 20), 0.01)) / (8.0 * 1920.0), 1.0, 0.02);
    EXPECT_NEAR(volume(shape::cone(Vec3::Zero(), Vec3(0, 0, 30), 6.0, 6.0)) /
                    (std::numbers::pi * 36.0 * 30.0 + volume_of_ball(6.0)),
                1.0, 0.03);
    // An elliptic rod with round ends.
    EXPECT_NEAR(volume(shape::sweep({{Vec3(0, 0, 0), 9, 5}, {Vec3(0, 0, 20), 9, 5}, {Vec3(0, 0, 40), 9, 5}},
                                    Vec3::UnitX())) /
                    (std::numbers::pi * 45.0 * 40.0 + 4.0 / 3.0 * std::numbers::pi * 45.0 * 5.0),
                1.0, 0.03);
}

TEST(SignedDistance, SheetThinnerThanItsCellsIsStillClosed) {
    shape::Compound thin;
    thin.add(shape::sheet({{0, {{0, 0, 0.4}, {20, 3, 0.3}}}, {30, {{4, 2, 0.4}, {22, -3, 0.2}}}}), 0.1);
    const shape::Surfaces made = shape::polygonised(thin, 2.0);
    EXPECT_EQ(render::unmatched_edges(made.outer), 0);
    EXPECT_EQ(render::unmatched_edges(made.core), 0);
}

TEST(SignedDistance, NoiseHasTheSpreadThatItNames) {
    double sum = 0.0, squares = 0.0;
    constexpr int count = 4000;
    for (int k = 0; k < count; ++k) {
        const double value = shape::fractal(Vec3(3.1 * k, 1.7 * k, 0.9 * k), 20.0, 2.5, 0.5, 11);
        EXPECT_LT(std::abs(value), 3.0);
        sum += value;
        squares += value * value;
    }
    EXPECT_NEAR(sum / count, 0.0, 0.05);
    EXPECT_GT(squares / count, 0.1);
    EXPECT_LT(squares / count, 0.5);
    EXPECT_NE(shape::noise(Vec3(1, 2, 3), 10.0, 1), shape::noise(Vec3(1, 2, 3), 10.0, 2));
}

}  // namespace
