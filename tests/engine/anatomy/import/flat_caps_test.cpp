#include <gtest/gtest.h>
#include <numbers>

#include "engine/anatomy/import/mesh_cut.h"
#include "engine/studies/anatomy_sign.h"
#include "tests/engine/anatomy/tubes.h"

namespace anatomy {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using test::tube;

}  // namespace

TEST(FlatCaps, AreFoundAtBothEndsOfATube) {
    for (const int around : {6, 8, 16, 48}) {
        const TriangleMesh open = tube(3, 40, around);
        EXPECT_TRUE(flat_caps(open).empty()) << around;
        const std::vector<FlatCap> caps = flat_caps(studies::flat_capped(open));
        ASSERT_EQ(caps.size(), 2u) << around;
        for (const FlatCap& cap : caps) {
            EXPECT_EQ(cap.triangles.size(), 3u * around);
            EXPECT_NEAR(std::abs(cap.normal.x()), 1, 1e-9);
            EXPECT_NEAR(cap.radius, 3, 0.01 + 3 * (1 - std::cos(std::numbers::pi / around)));
        }
    }
}

TEST(FlatCaps, MayBeOblique) {
    TriangleMesh mesh = tube(2, 40, 24);
    for (Vec3& v : mesh.vertices) v.x() += 0.8 * v.y();
    EXPECT_EQ(flat_caps(studies::flat_capped(mesh)).size(), 2u);
}

TEST(FlatCaps, ADomeOrATaperedTipIsNone) {
    // From full width to a small flat face over one radius.
    TriangleMesh mesh = studies::flat_capped(tube(2, 30, 24));
    for (Vec3& v : mesh.vertices) {
        const double past = v.x() - 28;
        if (past <= 0) continue;
        const double narrow = std::sqrt(std::max(0.05, 1 - past * past / 4));
        v.y() *= narrow, v.z() *= narrow;
    }
    const std::vector<FlatCap> caps = flat_caps(mesh);
    ASSERT_EQ(caps.size(), 1u);
    EXPECT_NEAR(caps[0].centre.x(), 0, 1e-9);
}

TEST(FlatCaps, TheSidesOfADuctAreNone) {
    TriangleMesh duct = tube(2, 60, 4);
    const std::vector<FlatCap> caps = flat_caps(studies::flat_capped(duct));
    for (const FlatCap& cap : caps) EXPECT_NEAR(std::abs(cap.normal.x()), 1, 1e-9);
}

}  // namespace anatomy
