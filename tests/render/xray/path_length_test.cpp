#include "render/xray/path_length.h"

#include <Eigen/Geometry>
#include <array>
#include <atomic>
#include <cmath>
#include <gtest/gtest.h>
#include <iostream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "engine/studies/all_hits.h"
#include "physics/geometry/random.h"
#include "render/patient/solids.h"

namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using render::CArm;
using render::Field;
using render::Rasteriser;

CArm oblique_stand(int pixels) {
    return CArm{.lao = 0.5, .cranial = -0.2, .isocentre = Vec3(3, -8, 12), .pixels = pixels};
}

const char* name_of(const testing::TestParamInfo<Rasteriser>& rasteriser) {
    return rasteriser.param == Rasteriser::OpenGl ? "OpenGl" : "Processor";
}

class PathLength : public testing::TestWithParam<Rasteriser> {};
INSTANTIATE_TEST_SUITE_P(By, PathLength, testing::Values(Rasteriser::OpenGl, Rasteriser::Processor), name_of);

TEST_P(PathLength, OfASphereIsItsChord) {
    constexpr double radius = 40.0;
    const Vec3 centre(10, 5, -7);
    // The tessellation stays inside the sphere by up to r(1 − cos(π/n)) = 0.012 mm at n = 128.
    const TriangleMesh mesh = render::ellipsoid(centre, Vec3(radius, radius, radius), 128);
    const CArm arm = oblique_stand(96);
    render::PathLengthRenderer renderer(GetParam());
    const auto result = renderer.render(renderer.add(mesh), arm);
    EXPECT_EQ(result.unbalanced_pixels, 0);
    double error = 0.0, bias = 0.0;
    int inside = 0;
    for (int j = 0; j < 96; ++j) {
        for (int i = 0; i < 96; ++i) {
            const Vec3 ray = render::ray_direction(arm, i + 0.5, j + 0.5), to = centre - render::source(arm);
            const double square = radius * radius - (to - to.dot(ray) * ray).squaredNorm();
            const double exact = square > 0.0 ? 2.0 * std::sqrt(square) : 0.0;
            const double length = result.length.values[static_cast<std::size_t>(j) * 96 + i];
            if (exact == 0.0) {
                EXPECT_EQ(length, 0.0);
                continue;
            }
            ++inside;
            error += std::abs(length - exact);
            bias += length - exact;
        }
    }
    ASSERT_GT(inside, 500);
    EXPECT_LT(error / inside, 0.01 * radius * 0.2);  // a fifth of the figure asked for
    EXPECT_LT(bias, 0.0);                            // inscribed
}

TEST_P(PathLength, RenderersThatGoFromThreadToThreadDrawTheSame) {
    // Each is used by one thread at a time, but by another one each time.
    constexpr int renderers = 4, poses = 6, rounds = 60;
    struct Shared {
        std::mutex mutex;
        render::PathLengthRenderer renderer{GetParam()};
        int mesh = 0;
    };
    std::array<Shared, renderers> all;
    for (int r = 0; r < renderers; ++r)
        all[r].mesh = all[r].renderer.add(render::ellipsoid({2.0 * r, 0, 0}, {30, 20.0 + r, 25}, 24));
    const auto pose = [](int k) {
        CArm arm = oblique_stand(48 + 16 * (k % 2));
        arm.lao = 0.2 * k;
        return arm;
    };
    std::vector<std::vector<float>> expected;
    for (int k = 0; k < renderers * poses; ++k) {
        Shared& one = all[k % renderers];
        expected.push_back(one.renderer.render(one.mesh, pose(k / renderers)).length.values);
    }
    std::atomic<int> different = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            geometry::Random random(static_cast<std::uint64_t>(100 + t));
            for (int round = 0; round < rounds; ++round) {
                const int k = static_cast<int>(random() * renderers * poses);
                Shared& one = all[k % renderers];
                const std::lock_guard lock(one.mutex);
                different += one.renderer.render(one.mesh, pose(k / renderers)).length.values != expected[k];
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(different, 0);
}

TEST_P(PathLength, AgreesWithAllHitsOfAnIndependentRayTracer) {
    // Overlapping, nested-free, concave along some rays: a bent tube crossed by an ellipsoid.
    TriangleMesh mesh = render::tube({{-40, 0, -30}, {-20, 10, 0}, {5, 0, 25}, {35, -15, 20}, {45, 0, -20}},
                                     Vec3(0, 1, 0), {9, 8, 7, 9, 10}, {6, 9, 8, 6, 7}, 40);
    render::append(mesh, render::ellipsoid(Vec3(5, 8, 5), Vec3(30, 14, 22), 60));
    render::PathLengthRenderer renderer(GetParam());
    const int drawn = renderer.add(mesh);
    const studies::AllHits oracle(mesh);
    // Amid the image, and half beyond its left and upper edge.
    for (const Vec3& isocentre : {Vec3(3, -8, 12), Vec3(95, 0, -75)}) {
        CArm arm = oblique_stand(200);
        arm.isocentre = isocentre;
        const Field length = renderer.render(drawn, arm).length;
        double square = 0.0;
        int compared = 0, close = 0;
        for (int j = 0; j < 200; ++j) {
            for (int i = 0; i < 200; ++i) {
                const auto sum =
                    oracle.along(render::source(arm), render::ray_direction(arm, i + 0.5, j + 0.5));
                const double seen = length.values[static_cast<std::size_t>(j) * 200 + i];
                // A ray through an edge may be counted twice by the tracer.
                if (sum.balance != 0 || (sum.length == 0.0 && seen == 0.0)) continue;
                ++compared;
                const double error = std::abs(seen - sum.length);
                close += error <= 0.01;
                if (error <= 0.01) square += error * error;
            }
        }
        EXPECT_GT(compared, 1500);
        // Silhouettes: the rasteriser snaps corners to 1/256 pixel, so a grazing ray may be in on one side
        // only.
        EXPECT_GE(close, 0.998 * compared);
        EXPECT_LE(std::sqrt(square / close), 0.0005);
    }
}

TEST_P(PathLength, AccumulatesOverWhatIsThere) {
    const TriangleMesh a = render::ellipsoid(Vec3::Zero(), Vec3(30, 20, 25));
    const TriangleMesh b = render::ellipsoid(Vec3(60, 5, 5), Vec3(40, 40, 20));
    const CArm arm = oblique_stand(64);
    render::PathLengthRenderer renderer(GetParam());
    const int first = renderer.add(a), second = renderer.add(b);
    Field sum(64, 64, 2.0f);
    EXPECT_EQ(renderer.accumulate(first, arm, sum), 0);
    EXPECT_EQ(renderer.accumulate(second, arm, sum), 0);
    const Field one = renderer.render(first, arm).length, other = renderer.render(second, arm).length;
    for (std::size_t i = 0; i < sum.values.size(); ++i)
        EXPECT_EQ(sum.values[i], 2.0f + one.values[i] + other.values[i]);
}

TEST_P(PathLength, DoesNotDependOnWhatWasDrawnBefore) {
    const TriangleMesh a = render::ellipsoid(Vec3::Zero(), Vec3(30, 20, 25));
    const TriangleMesh b = render::ellipsoid(Vec3(5, 5, 5), Vec3(40, 40, 20));
    const CArm arm = oblique_stand(64);
    render::PathLengthRenderer first(GetParam()), second(GetParam());
    const int own = first.add(a);
    const int other = second.add(b), later = second.add(a);
    second.render(other, oblique_stand(80));
    EXPECT_EQ(first.render(own, arm).length.values, second.render(later, arm).length.values);
}

TEST(PathLengthMesh, RefusesAnOpenMeshByNameWithItsBadPixels) {
    TriangleMesh mesh = render::ellipsoid(Vec3(100, 0, 0), Vec3(30, 20, 25));
    EXPECT_EQ(render::unmatched_edges(mesh), 0);
    EXPECT_NO_THROW(render::require_closed("left kidney", mesh));
    mesh.triangles.erase(mesh.triangles.begin() + 200);
    EXPECT_EQ(render::unmatched_edges(mesh), 3);
    try {
        render::require_closed("left kidney", mesh);
        FAIL() << "the hole was not found";
    } catch (const render::OpenMeshError& error) {
        EXPECT_EQ(error.edges(), 3);
        EXPECT_GT(error.pixels(), 0);
        EXPECT_NE(std::string(error.what()).find("left kidney"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find(std::to_string(error.pixels()) + " pixels"),
                  std::string::npos);
    }
}

TEST(PathLengthMesh, RefusesAMeshThatOverlapsItselfOrIsInsideOut) {
    const TriangleMesh ball = render::ellipsoid(Vec3::Zero(), Vec3(30, 20, 25));
    EXPECT_NO_THROW(render::require_simple("heart", ball));
    TriangleMesh two = ball;
    const int n = static_cast<int>(ball.vertices.size());
    for (const Vec3& v : ball.vertices) two.vertices.push_back(v + Vec3(40, 0, 0));
    for (const auto& t : ball.triangles) two.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
    EXPECT_EQ(render::unmatched_edges(two), 0);
    try {
        render::require_simple("heart", two);
        FAIL() << "the overlap was not found";
    } catch (const render::OverlappingMeshError& error) {
        EXPECT_GT(error.pixels(), 100);
        EXPECT_NE(std::string(error.what()).find("'heart' overlaps itself"), std::string::npos);
    }
    TriangleMesh turned = ball;
    for (auto& t : turned.triangles) std::swap(t[0], t[1]);
    EXPECT_THROW(render::require_simple("heart", turned), render::OverlappingMeshError);
    for (int i = 0; i < n; ++i) two.vertices[n + i] += Vec3(40, 0, 0);
    EXPECT_NO_THROW(render::require_simple("heart", two)) << "side by side they are two bodies";
    TriangleMesh pricked = ball;  // a corner on the far side: a thin spike, seen by few rays
    pricked.vertices[pricked.triangles[500][0]] *= -1.2;
    EXPECT_NO_THROW(render::require_simple("heart", pricked));
}

TEST(PathLengthMesh, TakesAnUnindexedMeshAsClosed) {
    const TriangleMesh mesh = render::ellipsoid(Vec3::Zero(), Vec3(30, 20, 25));
    TriangleMesh loose;
    for (const auto& t : mesh.triangles) {
        const int n = static_cast<int>(loose.vertices.size());
        for (int corner : t) loose.vertices.push_back(mesh.vertices[corner]);
        loose.triangles.push_back({n, n + 1, n + 2});
    }
    EXPECT_EQ(render::unmatched_edges(loose), 0);
}

TEST(PathLengthMesh, RefusesATriangleWithAMissingVertex) {
    TriangleMesh mesh = render::ellipsoid(Vec3::Zero(), Vec3(30, 20, 25));
    mesh.triangles.back()[1] = static_cast<int>(mesh.vertices.size());
    EXPECT_THROW(render::require_closed("spleen", mesh), std::runtime_error);
    mesh.triangles.back()[1] = 0;
    mesh.vertices[4].z() = std::nan("");
    EXPECT_THROW(render::require_closed("spleen", mesh), std::runtime_error);
}

TEST_P(PathLength, CountsPixelsOfAMeshThatReachesBehindTheSource) {
    const CArm arm = oblique_stand(64);
    render::PathLengthRenderer renderer(GetParam());
    const int around_source = renderer.add(render::ellipsoid(render::source(arm), Vec3(100, 100, 100)));
    EXPECT_GT(renderer.render(around_source, arm).unbalanced_pixels, 1000);
}

/// A bent tube or an ellipsoid, from needles to walls that reach far beyond the image, in front of the
/// source.
TriangleMesh random_body(geometry::Random& random, const CArm& arm) {
    const auto somewhere = [&](double reach) {
        return Vec3(random.between(-reach, reach), random.between(-reach, reach),
                    random.between(-reach, reach));
    };
    const double size = std::pow(10.0, random.between(-0.5, 2.5));
    TriangleMesh mesh;
    if (random() < 0.5) {
        std::vector<Vec3> path{somewhere(size)};
        std::vector<double> widths, heights;
        for (int k = 0; k < 5; ++k) path.push_back(path.back() + 0.5 * somewhere(size) + Vec3(0, 0, size));
        for (std::size_t k = 0; k < path.size(); ++k) {
            widths.push_back(size * random.between(0.02, 0.4));
            heights.push_back(size * random.between(0.02, 0.4));
        }
        mesh = render::tube(path, Vec3(0, 1, 0), widths, heights, 12);
    } else {
        mesh = render::ellipsoid(
            somewhere(size),
            size * Vec3(random.between(0.02, 2), random.between(0.02, 2), random.between(0.02, 2)),
            4 + static_cast<int>(random() * 40));
    }
    for (Vec3& v : mesh.vertices) {
        v += arm.isocentre;
        const double depth = render::axes(arm).beam.dot(v - render::source(arm));
        // A wall may be at the source, and is then pressed flat before it.
        if (depth < 2.0) v += (2.0 - depth) * render::axes(arm).beam;
    }
    return mesh;
}

CArm random_stand(geometry::Random& random) {
    CArm arm{.lao = random.between(-2, 2),
             .cranial = random.between(-0.7, 0.7),
             .pixels = 16 << (2 * random() > 1)};
    arm.pixels += static_cast<int>(random() * 60);
    arm.isocentre = Vec3(random.between(-200, 200), random.between(-200, 200), random.between(-200, 200));
    arm.sid = random.between(900, 1300);
    arm.sod = random.between(500, 850);
    arm.detector_width = random.between(100, 400);
    return arm;
}

TEST(PathLengthRasterisers, ShareEveryPixelOfAThousandRandomBodies) {
    std::array<render::PathLengthRenderer, 2> renderers{render::PathLengthRenderer(Rasteriser::OpenGl),
                                                        render::PathLengthRenderer(Rasteriser::Processor)};
    int covered = 0, different = 0;
    double square = 0;
    for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        geometry::Random random(seed);
        const CArm arm = random_stand(random);
        const TriangleMesh mesh = random_body(random, arm);
        std::vector<Eigen::Vector3f> breath;
        for (const Vec3& v : mesh.vertices)
            breath.push_back(Eigen::Vector3f(0, 0, static_cast<float>(3 * std::sin(0.02 * v.x()))));
        const double phase = random() < 0.3 ? 0.0 : random();
        std::array<render::PathLengthRenderer::Result, 2> results;
        for (std::size_t by = 0; by < results.size(); ++by)
            results[by] = renderers[by].render(renderers[by].add(mesh, breath, {}), arm, {.breath = phase});
        const auto& [opengl, processor] = results;
        EXPECT_EQ(processor.unbalanced_pixels, 0);
        for (std::size_t k = 0; k < processor.length.values.size(); ++k) {
            const double one = opengl.length.values[k], other = processor.length.values[k];
            ASSERT_TRUE(std::isfinite(other) && other >= 0);
            if (one == 0 && other == 0) continue;
            ++covered;
            const double error = std::abs(one - other);
            if (error > 0.01 + 1e-3 * std::max(one, other))
                ++different;
            else
                square += error * error;
        }
    }
    std::cout << covered << " pixels, " << different << " differ; rms of the others "
              << std::sqrt(square / (covered - different)) << " mm\n";
    EXPECT_GT(covered, 100000);
    EXPECT_LT(different, 0.005 * covered);
    EXPECT_LT(std::sqrt(square / (covered - different)), 0.002);
}

}  // namespace
