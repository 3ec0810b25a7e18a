#include "render/xray/surface_crossings.h"

#include <cmath>
#include <gtest/gtest.h>
#include <utility>

#include "physics/geometry/mesh_topology.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"

namespace {

using geometry::Vec3;
using render::CArm;

TEST(SurfaceCrossings, SumToPathLengths) {
    geometry::TriangleMesh mesh =
        render::tube({{-40, 0, -30}, {-20, 10, 0}, {5, 0, 25}, {35, -15, 20}, {45, 0, -20}}, Vec3(0, 1, 0),
                     {9, 8, 7, 9, 10}, {6, 9, 8, 6, 7}, 40);
    render::append(mesh, render::ellipsoid(Vec3(5, 8, 5), Vec3(30, 14, 22), 60));
    CArm arm{.lao = 0.5, .cranial = -0.2, .isocentre = Vec3(3, -8, 12), .pixels = 200};
    const auto crossings = render::surface_crossings(mesh, arm, 1);
    ASSERT_EQ(crossings.side, 200);
    render::PathLengthRenderer renderer;
    const render::Field length = renderer.render(renderer.add(mesh), arm).length;
    const double step = render::pixel_width(arm) / arm.sid;
    double square = 0;
    int inside = 0, close = 0;
    for (int v = 0; v < 200; ++v) {
        for (int u = 0; u < 200; ++u) {
            const double x = (u - 99.5) * step, y = (v - 99.5) * step;
            double sum = 0;
            int balance = 0;
            float before = -1e9f;
            for (const render::Crossing& crossing : crossings.of(u, v)) {
                EXPECT_GE(crossing.depth, before);
                before = crossing.depth;
                sum += (crossing.entry ? -1 : 1) * crossing.depth * std::sqrt(1 + x * x + y * y);
                balance += crossing.entry ? 1 : -1;
            }
            EXPECT_EQ(balance, 0);
            const double drawn = length.values[static_cast<std::size_t>(v) * 200 + u];
            if (sum == 0 && drawn == 0) continue;
            ++inside;
            close += std::abs(sum - drawn) < 0.01;
            square += (sum - drawn) * (sum - drawn);
        }
    }
    EXPECT_GT(inside, 2500);
    // OSMesa snaps corners to 1/256 pixel: a wall seen edge on moves by as much times its slope.
    EXPECT_GE(close, 0.98 * inside);
    EXPECT_LT(std::sqrt(square / inside), 0.02);
}

TEST(SurfaceCrossings, AreOneEntryAndOneExitThroughEdgesAndCorners) {
    // A box whose corners, edges and diagonals fall on rays: those are 1 mm apart on the detector.
    CArm arm{.sid = 1000, .sod = 500, .detector_width = 128, .pixels = 64};
    geometry::TriangleMesh box;
    for (const double depth : {450.0, 550.0}) {
        for (const auto& [u, v] : {std::pair{40, 40}, {80, 40}, {80, 80}, {40, 80}}) {
            const double scale = depth / arm.sid;
            box.vertices.emplace_back((u + 0.5 - 64) * scale, arm.sod - depth, -(v + 0.5 - 64) * scale);
        }
    }
    box.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {0, 4, 5}, {0, 5, 1},
                     {1, 5, 6}, {1, 6, 2}, {2, 6, 7}, {2, 7, 3}, {3, 7, 4}, {3, 4, 0}};
    ASSERT_EQ(render::unmatched_edges(box), 0);
    if (geometry::signed_volume(box) < 0)
        for (auto& t : box.triangles) std::swap(t[1], t[2]);
    const auto crossings = render::surface_crossings(box, arm, 2);
    int inside = 0;
    for (int v = 0; v < 128; ++v) {
        for (int u = 0; u < 128; ++u) {
            const auto met = crossings.of(u, v);
            if (met.empty()) continue;
            ++inside;
            ASSERT_EQ(met.size(), 2u) << u << " " << v;
            EXPECT_TRUE(met[0].entry && !met[1].entry) << u << " " << v;
            EXPECT_NEAR(met[0].depth, -50, 1e-3);
            EXPECT_NEAR(met[1].depth, 50, 1e-3);
        }
    }
    EXPECT_EQ(inside, 40 * 40);  // two of the four sides belong to it
}

TEST(SurfaceCrossings, LeaveOutWhatIsBehindTheSource) {
    CArm arm{.pixels = 64};
    const auto around = render::ellipsoid(render::source(arm), Vec3(100, 100, 100));
    const auto crossings = render::surface_crossings(around, arm, 2);
    for (int v = 0; v < 128; ++v) {
        for (int u = 0; u < 128; ++u) {
            for (const render::Crossing& crossing : crossings.of(u, v)) {
                EXPECT_TRUE(std::isfinite(crossing.depth));
                EXPECT_GT(crossing.depth, -arm.sod);
            }
        }
    }
}

}  // namespace
