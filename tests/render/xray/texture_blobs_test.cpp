#include "render/xray/texture_blobs.h"

#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "physics/geometry/random.h"
#include "physics/geometry/vec.h"
#include "render/xray/fluoroscope.h"

namespace {

using geometry::Vec3;
using render::CArm;
using render::Field;
using render::TextureBlob;

CArm lump_view(int pixels, double width) {
    return CArm{.lao = 0.6, .cranial = -0.3, .detector_width = width, .pixels = pixels};
}

/// ∫ fraction · (1 − ρ²)^(3/2) along a ray, by sums over small steps [mm].
double summed(const TextureBlob& blob, const Vec3& from, const Vec3& way) {
    const Vec3 middle = blob.middle.cast<double>(), axis = blob.axis.cast<double>();
    const double at = (middle - from).dot(way), reach = 1.2 * blob.radius * blob.elongation;
    constexpr int steps = 4000;
    double sum = 0;
    for (int k = 0; k < steps; ++k) {
        const Vec3 off = from + (at - reach + 2 * reach * (k + 0.5) / steps) * way - middle;
        const double along = off.dot(axis), across = off.squaredNorm() - along * along;
        const double square =
            (along * along / std::pow(blob.elongation, 2) + across) / std::pow(blob.radius, 2);
        if (square < 1) sum += std::pow(1 - square, 1.5);
    }
    return blob.fraction * sum * 2 * reach / steps;
}

TEST(TextureBlobs, CastTheIntegralOfTheirShareAlongEachRay) {
    const CArm arm = lump_view(300, 40);
    const Vec3 source = render::source(arm);
    for (const TextureBlob& blob : {TextureBlob{{3, -2, 4}, {0, 0, 1}, 8, 1, 1},
                                    TextureBlob{{0, 0, 0}, {0.6f, 0, 0.8f}, 4, 2.5f, -0.7f},
                                    TextureBlob{{-2, 5, 1}, {0, 1, 0}, 5, 1.8f, 0.4f}}) {
        Field sum(arm.pixels, arm.pixels);
        render::add_lengths(std::span(&blob, 1), arm, sum);
        double worst = 0, largest = 0;
        for (int j = 5; j < arm.pixels; j += 10) {
            for (int i = 5; i < arm.pixels; i += 10) {
                const double own = sum.values[static_cast<std::size_t>(j) * arm.pixels + i];
                const double exact = summed(blob, source, render::ray_direction(arm, i + 0.5, j + 0.5));
                worst = std::max(worst, std::abs(own - exact));
                largest = std::max(largest, std::abs(exact));
            }
        }
        EXPECT_GT(largest, 2.0);
        // Rays are taken as parallel over a blob: they spread by 1 % from its front to its back.
        EXPECT_LT(worst, 0.02 * largest);
    }
}

TEST(TextureBlobs, KeepTheirContentHoweverCoarseThePixels) {
    for (const float radius : {0.1f, 0.4f, 1.0f, 5.0f}) {
        for (const int pixels : {32, 64, 256}) {
            const CArm arm = lump_view(pixels, 60);
            geometry::Random random(7);
            // Pixels are sampled at their centres: the mean over places counts.
            double sum = 0, expected = 0;
            for (int k = 0; k < 400; ++k) {
                const double x = random.between(-3, 3), y = random.between(-3, 3), z = random.between(-3, 3);
                const TextureBlob blob{Vec3(x, y, z).cast<float>(), Eigen::Vector3f(1, 2, -1).normalized(),
                                       radius, 2, -0.8f};
                Field lengths(pixels, pixels);
                render::add_lengths(std::span(&blob, 1), arm, lengths);
                const double depth = render::project(arm, Vec3(x, y, z)).depth;
                const double side = render::pixel_width(arm) * depth / arm.sid;  // at the blob [mm]
                for (const float value : lengths.values) sum += value * side * side;
                expected += render::content(blob);
            }
            EXPECT_NEAR(sum / expected, 1.0, 0.03) << radius << " mm at " << pixels << " pixels";
        }
    }
}

TEST(TextureBlobs, MoveWithTheirDepth) {
    // Two texture_blobs on one ray part when the arm turns, as far as their depths say.
    const std::vector<TextureBlob> texture_blobs{{{0, -60, 0}, {0, 0, 1}, 2, 1, 1},
                                                 {{0, 60, 0}, {0, 0, 1}, 2, 1, 1}};
    CArm arm{.detector_width = 120, .pixels = 256};
    const auto centre = [&](const TextureBlob& blob) {
        Field sum(arm.pixels, arm.pixels);
        render::add_lengths(std::span(&blob, 1), arm, sum);
        double x = 0, total = 0;
        for (int i = 0; i < arm.pixels; ++i)
            for (int j = 0; j < arm.pixels; ++j) {
                x += (i + 0.5) * sum.values[static_cast<std::size_t>(j) * arm.pixels + i];
                total += sum.values[static_cast<std::size_t>(j) * arm.pixels + i];
            }
        return x / total;
    };
    EXPECT_NEAR(centre(texture_blobs[0]), centre(texture_blobs[1]), 0.05);
    arm.lao = 0.2;
    for (const TextureBlob& blob : texture_blobs)
        EXPECT_NEAR(centre(blob), render::project(arm, blob.middle.cast<double>()).x, 0.05);
    EXPECT_GT(std::abs(centre(texture_blobs[0]) - centre(texture_blobs[1])), 60.0);
}

TEST(TextureBlobs, BehindTheSourceOrOutsideTheImageAddNothing) {
    CArm arm{.pixels = 64};
    const Vec3 source = render::source(arm), beam = render::axes(arm).beam;
    Field sum(64, 64);
    std::vector<TextureBlob> texture_blobs(3);
    texture_blobs[0].middle = (source - 50.0 * beam).cast<float>();
    texture_blobs[1].middle = source.cast<float>();
    texture_blobs[2].middle = {0, 0, 500};
    render::add_lengths(texture_blobs, arm, sum);
    for (const float value : sum.values) ASSERT_EQ(value, 0.0f);
}

TEST(TextureBlobs, AreInTheImageAndInTheTruthOfTheirLayer) {
    const auto slab = [](std::vector<TextureBlob> texture_blobs) {
        render::TissueLayer layer{"slab", render::Material::SoftTissue, render::Material::Air,
                                  geometry::TriangleMesh{}};
        const Vec3 low(-200, -50, -200), high(200, 50, 200);
        for (int c = 0; c < 8; ++c)
            layer.mesh.vertices.emplace_back(c & 1 ? high.x() : low.x(), c & 2 ? high.y() : low.y(),
                                             c & 4 ? high.z() : low.z());
        layer.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
        layer.texture_blobs = std::move(texture_blobs);
        return std::vector<render::TissueLayer>{layer};
    };
    CArm arm{.pixels = 64};
    const TextureBlob blob{{20, 0, 30}, {0, 0, 1}, 10, 1, 1};
    render::FluoroscopeConfig config;
    config.scatter = 0;
    render::Fluoroscope without(config, slab({})), with(config, slab({blob}));
    const Field bare = without.expected_quanta(arm, {}, {}), textured = with.expected_quanta(arm, {}, {});
    const Field smooth = without.layer_lengths(arm, {})[0].length,
                rough = with.layer_lengths(arm, {})[0].length;
    Field own(64, 64);
    render::add_lengths(std::span(&blob, 1), arm, own);
    const render::Pixel at = render::project(arm, blob.middle.cast<double>());
    const auto middle = static_cast<std::size_t>(at.y) * 64 + static_cast<std::size_t>(at.x);
    EXPECT_GT(own.values[middle], 9.0f);
    for (std::size_t i = 0; i < own.values.size(); ++i)
        ASSERT_NEAR(rough.values[i] - smooth.values[i], own.values[i], 1e-4);
    // Against a place beside it, for exposure rises with what is in the measuring field.
    const double darker = textured.values[middle] / bare.values[middle] * bare.values[0] / textured.values[0];
    // μ at 70 and 40 keV.
    EXPECT_LT(darker, std::exp(-0.0195 * own.values[middle]));
    EXPECT_GT(darker, std::exp(-0.0285 * own.values[middle]));
}

}  // namespace
