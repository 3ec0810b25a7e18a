#include "render/xray/c_arm.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

namespace {

using geometry::Vec3;
using render::CArm;

constexpr double degree = std::numbers::pi / 180.0;

Vec3 detector_centre(const CArm& arm) {
    return render::source(arm) + arm.sid * render::axes(arm).beam;
}

TEST(CArm, Lao30PutsTheDetectorOverThePatientsLeftAndTheSourceBehindTheRight) {
    CArm arm{.lao = 30.0 * degree};
    EXPECT_NEAR(render::source(arm).x(), -arm.sod * 0.5, 1e-9);             // right
    EXPECT_NEAR(render::source(arm).y(), arm.sod * std::sqrt(0.75), 1e-9);  // posterior
    EXPECT_GT(detector_centre(arm).x(), 0.0);
    EXPECT_LT(detector_centre(arm).y(), 0.0);
    // What lies behind moves to the viewer's right: the spine, in a left anterior oblique view.
    EXPECT_GT(render::project(arm, Vec3(0, 40, 0)).x, 256.0);
}

TEST(CArm, CranialTiltRaisesTheDetectorTowardTheHead) {
    CArm arm{.cranial = 20.0 * degree};
    EXPECT_NEAR(detector_centre(arm).z(), (arm.sid - arm.sod) * std::sin(20.0 * degree), 1e-9);
    EXPECT_LT(render::source(arm).z(), 0.0);
}

TEST(CArm, IsocentreMapsToTheImageCentreAtAnyAngle) {
    CArm arm{.isocentre = Vec3(12, -30, 45)};
    for (double lao : {-90.0, -30.0, 0.0, 45.0, 120.0}) {
        for (double cranial : {-45.0, 0.0, 30.0}) {
            arm.lao = lao * degree;
            arm.cranial = cranial * degree;
            const render::Pixel p = render::project(arm, arm.isocentre);
            EXPECT_NEAR(p.x, 256.0, 1e-9);
            EXPECT_NEAR(p.y, 256.0, 1e-9);
            EXPECT_NEAR(p.depth, arm.sod, 1e-9);
        }
    }
}

TEST(CArm, ShowsThePatientsLeftOnTheRightAndTheHeadUp) {
    const CArm arm;
    EXPECT_GT(render::project(arm, Vec3(10, 0, 0)).x, 256.0);
    EXPECT_LT(render::project(arm, Vec3(0, 0, 10)).y, 256.0);
}

TEST(CArm, MagnifiesBySidOverSodAtTheIsocentre) {
    const CArm arm;
    const double on_detector = (render::project(arm, Vec3(10, 0, 0)).x - 256.0) * render::pixel_width(arm);
    EXPECT_NEAR(on_detector, 10.0 * arm.sid / arm.sod, 1e-9);
    // Nearer to the source, larger.
    EXPECT_GT(render::project(arm, Vec3(10, 50, 0)).x, render::project(arm, Vec3(10, 0, 0)).x);
}

TEST(CArm, RaysLeadBackToThePointsTheyShow) {
    CArm arm{.lao = -35.0 * degree, .cranial = 15.0 * degree, .isocentre = Vec3(5, 6, 7)};
    const Vec3 point(20, -40, 60);
    const render::Pixel p = render::project(arm, point);
    const Vec3 ray = render::ray_direction(arm, p.x, p.y);
    EXPECT_NEAR((point - render::source(arm)).normalized().dot(ray), 1.0, 1e-14);
}

TEST(CArm, ListsEverythingThatIsWrong) {
    EXPECT_TRUE(render::problems(CArm{}).empty());
    CArm arm{.lao = 120.0 * degree, .cranial = -45.0 * degree};
    EXPECT_TRUE(render::problems(arm).empty()) << "the limits themselves are allowed";
    arm.lao = 121.0 * degree;
    arm.cranial = 46.0 * degree;
    arm.sod = 1200.0;
    arm.pixels = 0;
    arm.detector_width = 0.0;
    EXPECT_EQ(render::problems(arm).size(), 5u);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (double CArm::*field : {&CArm::lao, &CArm::cranial, &CArm::sid, &CArm::sod, &CArm::detector_width}) {
        CArm bad;
        bad.*field = nan;
        EXPECT_FALSE(render::problems(bad).empty());
    }
    CArm lost;
    lost.isocentre.y() = nan;
    EXPECT_EQ(render::problems(lost).size(), 1u);
}

}  // namespace
