#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <stdexcept>

#include "render/patient/patient.h"
#include "render/patient/solids.h"
#include "render/xray/exposure_meter.h"
#include "render/xray/path_length.h"

namespace {

using geometry::Vec3;
using render::CArm;
using render::CoarseLengths;
using render::Field;

CArm coarse_arm(double lao, double cranial) {
    return CArm{.lao = lao, .cranial = cranial, .pixels = 48};
}

Field coarse(const geometry::TriangleMesh& mesh, const CArm& arm) {
    CoarseLengths lengths;
    Field sum(arm.pixels, arm.pixels);
    lengths.accumulate(lengths.add(mesh), arm, sum);
    return sum;
}

}  // namespace

TEST(CoarseLengths, AreThoseOfTheRasteriserThroughEveryLayerOfAPatient) {
    const std::vector<render::TissueLayer> layers = render::make_patient({});
    for (const CArm& arm : {coarse_arm(0, 0), coarse_arm(1.5, 0), coarse_arm(-0.6, 0.5)}) {
        double square = 0;
        int apart = 0, pixels = 0;
        for (const render::TissueLayer& layer : layers) {
            const Field own = coarse(layer.mesh, arm);
            render::PathLengthRenderer renderer;
            const Field theirs = renderer.render(renderer.add(layer.mesh), arm).length;
            for (std::size_t i = 0; i < own.values.size(); ++i, ++pixels) {
                const double off = own.values[i] - theirs.values[i];
                // A ray along a silhouette meets it or not, and bones with foramina and textures have many.
                if (std::abs(off) > 0.05)
                    ++apart;
                else
                    square += off * off;
            }
        }
        EXPECT_LE(apart, pixels / 3000) << arm.lao;
        EXPECT_LT(std::sqrt(square / pixels), 0.002) << arm.lao;
    }
}

TEST(CoarseLengths, OfABallAreItsChordsAlsoThroughCornersAndEdges) {
    // The middle ray of an odd image runs through poles of the mesh.
    const double radius = 40;
    const geometry::TriangleMesh ball = render::ellipsoid(Vec3::Zero(), Vec3::Constant(radius));
    for (const double lao : {0.0, 0.5, 1.5707963267948966}) {
        CArm arm = coarse_arm(lao, 0);
        arm.pixels = 47;
        const Field length = coarse(ball, arm);
        EXPECT_NEAR(length.values[23 * 47 + 23], 2 * radius, 0.02 * radius) << lao;
        for (int j = 0; j < 47; ++j) {
            for (int i = 0; i < 47; ++i) {
                const Vec3 ray = render::ray_direction(arm, i + 0.5, j + 0.5);
                const double away = ray.cross(arm.isocentre - render::source(arm)).norm();
                const double chord = away < radius ? 2 * std::sqrt(radius * radius - away * away) : 0;
                if (std::abs(away - radius) > 0.1 * radius) {
                    ASSERT_NEAR(length.values[j * 47 + i], chord, 0.06 * radius) << i << ' ' << j;
                }
            }
        }
    }
}

TEST(CoarseLengths, OfWhatReachesBehindTheSourceAreNothing) {
    CArm arm = coarse_arm(0, 0);
    const Vec3 at = render::source(arm);
    for (const float value : coarse(render::ellipsoid(at, Vec3(50, 50, 50)), arm).values)
        ASSERT_EQ(value, 0.0f);
    const Vec3 behind = at - 200.0 * render::axes(arm).beam;
    for (const float value : coarse(render::ellipsoid(behind, Vec3(50, 50, 50)), arm).values)
        ASSERT_EQ(value, 0.0f);
}

TEST(CoarseLengths, OfRandomMeshesAreFiniteAndATriangleWithoutItsVertexIsRefused) {
    constexpr unsigned seed = 5;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-800, 800);
    geometry::TriangleMesh soup;
    for (int i = 0; i < 300; ++i) soup.vertices.emplace_back(place(random), place(random), place(random));
    for (int i = 0; i < 200; ++i)
        soup.triangles.push_back({static_cast<int>(random() % 300), static_cast<int>(random() % 300),
                                  static_cast<int>(random() % 300)});
    for (const float value : coarse(soup, coarse_arm(0.3, 0.1)).values)
        ASSERT_TRUE(std::isfinite(value) && value >= 0) << "seed " << seed;
    soup.triangles.push_back({0, 1, 300});
    CoarseLengths lengths;
    EXPECT_THROW(lengths.add(soup), std::invalid_argument);
}
