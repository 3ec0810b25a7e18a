#include "render/patient.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "render/path_length.h"
#include "render/solids.h"

namespace {

using physics::Vec3;

TEST(Solids, AreClosedOutwardAndOfTheRightVolume) {
    const auto ball = render::ellipsoid(Vec3(5, 6, 7), Vec3(10, 20, 30), 64);
    EXPECT_EQ(render::unmatched_edges(ball), 0);
    EXPECT_NEAR(render::signed_volume(ball) / (4.0 / 3.0 * std::numbers::pi * 6000.0), 1.0, 0.01);
    // The same, whichever way the path runs.
    for (double end : {40.0, -40.0}) {
        const auto rod = render::tube({{0, 0, 0}, {0, 0, end}}, Vec3(1, 0, 0), {5, 5}, {3, 3}, 64);
        EXPECT_EQ(render::unmatched_edges(rod), 0);
        EXPECT_NEAR(render::signed_volume(rod) / (std::numbers::pi * 15.0 * 40.0), 1.0, 0.01);
    }
}

TEST(Patient, ConsistsOfClosedMeshes) {
    for (const auto& layer : render::make_patient({})) {
        EXPECT_FALSE(layer.mesh.triangles.empty()) << layer.name;
        EXPECT_EQ(render::unmatched_edges(layer.mesh), 0) << layer.name;
        EXPECT_GT(render::signed_volume(layer.mesh), 0.0) << layer.name;
    }
}

TEST(Patient, HasItsSpineBehindTheAortaAndItsSkinAroundTheVessels) {
    std::vector<Vec3> points;
    for (int i = 0; i <= 32; ++i) {
        for (int k = 0; k < 12; ++k) {
            const double angle = std::numbers::pi * k / 6.0;
            points.emplace_back(12.0 + 10.0 * std::cos(angle), -5.0 + 10.0 * std::sin(angle), 4.0 * i);
        }
    }
    points.emplace_back(70, -60, -150);
    const auto spec = render::patient_around(points, 0.0);
    EXPECT_NEAR(spec.spine_x, 12.0, 1e-9);
    EXPECT_GT(spec.spine_front, 5.0);  // the wall of the aorta
    EXPECT_LT(spec.spine_front, 15.0);
    const auto layers = render::make_patient(spec);
    const auto& skin = layers.front().mesh;
    Vec3 low = skin.vertices.front(), high = low;
    for (const Vec3& v : skin.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    for (const Vec3& p : points) {
        EXPECT_TRUE((p.array() > low.array()).all() && (p.array() < high.array()).all());
    }
}

}  // namespace
