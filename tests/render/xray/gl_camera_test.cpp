#include "render/xray/gl_camera.h"

#include <cmath>
#include <glm/vec4.hpp>
#include <gtest/gtest.h>
#include <random>

namespace render {

TEST(GlCamera, SeesEveryPlaceWhereTheExactProjectionDoes) {
    std::mt19937 random(5);
    const auto between = [&](double a, double b) {
        return a + (b - a) * std::ldexp(static_cast<double>(random()), -32);
    };
    for (int k = 0; k < 2000; ++k) {
        CArm arm;
        arm.lao = between(-2.0, 2.0);
        arm.cranial = between(-0.78, 0.78);
        arm.sid = between(900, 1300);
        arm.sod = between(500, 800);
        arm.isocentre = {between(-200, 200), between(-200, 200), between(-400, 400)};
        arm.detector_width = between(40, 400);
        arm.pixels = 16 << (random() % 7);
        const geometry::Vec3 about(between(-300, 300), between(-300, 300), between(-300, 300));
        const Pixel exact = project(arm, arm.isocentre + about);
        const glm::dvec4 eye = view_matrix(arm) * glm::dvec4(about.x(), about.y(), about.z(), 1);
        EXPECT_NEAR(-eye.z, exact.depth, 1e-9) << k;
        const glm::dvec4 clip = projection_matrix(arm) * eye;
        EXPECT_NEAR(clip.w, exact.depth, 1e-9) << k;
        EXPECT_EQ(clip.z, 0) << k;
        EXPECT_NEAR(0.5 * (1 + clip.x / clip.w) * arm.pixels, exact.x, 1e-8 * arm.pixels) << k;
        EXPECT_NEAR(0.5 * (1 + clip.y / clip.w) * arm.pixels, exact.y, 1e-8 * arm.pixels) << k;
    }
}

}  // namespace render
