#include "render/patient.h"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "render/path_length.h"
#include "render/solids.h"

namespace {

using physics::Vec3;
using render::CArm;

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

TEST(Patient, KeepsItsBonesUnderItsSkin) {
    // Seen from the side and obliquely, no bone stands where no tissue is.
    const auto layers = render::make_patient({});
    render::PathLengthRenderer renderer;
    for (double lao : {0.5, 1.0, 1.5}) {
        for (double z : {-100.0, 50.0}) {
            CArm arm;
            arm.lao = lao;
            arm.isocentre = Vec3(0, 30, z);
            arm.pixels = 128;
            arm.detector_width = 500.0;
            const auto tissue = renderer.render(renderer.add(layers[1].mesh), arm).length;
            const auto bone = renderer.render(renderer.add(layers[2].mesh), arm).length;
            int bare = 0;
            for (std::size_t i = 0; i < bone.values.size(); ++i)
                bare += bone.values[i] > 0 && tissue.values[i] == 0;
            EXPECT_EQ(bare, 0) << "at " << lao << " rad and z " << z;
        }
    }
}

}  // namespace
