#include "render/panel/readout.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double one_degree = std::numbers::pi / 180.0;

TEST(Readout, FiguresHaveTheirDigitsAndMissingOnesADash) {
    EXPECT_EQ(render::figure_text(41.72, 1), "41.7");
    EXPECT_EQ(render::figure_text(-3.0, 2), "-3.00");
    EXPECT_EQ(render::figure_text(-0.001, 1), "0.0") << "no minus before nothing";
    EXPECT_EQ(render::figure_text(1e300, 1), "1.0e+300");
    for (const auto value : {std::optional<double>(), std::optional(nan), std::optional(infinity)}) {
        EXPECT_EQ(render::figure_text(value, 1), "--");
    }
}

TEST(Readout, PulseRatesShowHalves) {
    EXPECT_EQ(render::rate_text(15.0), "15");
    EXPECT_EQ(render::rate_text(7.5), "7.5");
    EXPECT_EQ(render::rate_text(std::nullopt), "--");
}

TEST(Readout, AnglesAreNamedBySide) {
    EXPECT_EQ(render::primary_angle_text(30.0 * one_degree), "LAO 30°");
    EXPECT_EQ(render::primary_angle_text(-12.4 * one_degree), "RAO 12°");
    EXPECT_EQ(render::primary_angle_text(-0.3 * one_degree), "LAO 0°");
    EXPECT_EQ(render::secondary_angle_text(10.0 * one_degree), "CRAN 10°");
    EXPECT_EQ(render::secondary_angle_text(-25.0 * one_degree), "CAUD 25°");
    EXPECT_EQ(render::primary_angle_text(nan), "LAO --");
}

TEST(Readout, ClocksCountMinutesAndHours) {
    EXPECT_EQ(render::clock_text(0.0), "0:00");
    EXPECT_EQ(render::clock_text(258.9), "4:18");
    EXPECT_EQ(render::clock_text(3600.0 + 2 * 60.0 + 7.0), "1:02:07");
    for (const auto value :
         {std::optional<double>(), std::optional(nan), std::optional(-1.0), std::optional(1e30)}) {
        EXPECT_EQ(render::clock_text(value), "--");
    }
}

TEST(Readout, PressureIsSystolicDiastolicAndMeanOrADash) {
    render::Readout r;
    r.systolic = 118.4;
    r.diastolic = 79;
    EXPECT_EQ(render::pressure_text(r), "--");
    r.mean_pressure = 92.6;
    EXPECT_EQ(render::pressure_text(r), "118/79 (93)");
    r.diastolic = nan;
    EXPECT_EQ(render::pressure_text(r), "--");
}

TEST(Readout, ABalloonHasItsPressureWidthAndStent) {
    render::Readout::Balloon b;
    b.pressure = 8, b.nominal = 8, b.rated = 14;
    EXPECT_EQ(inflation_text(b), "8.0 atm (nominal 8, rated 14)");
    b.diameter = 6.04, b.waist = 6;
    EXPECT_EQ(balloon_width_text(b), "6.0 mm");
    b.waist = 4.12;
    EXPECT_EQ(balloon_width_text(b), "6.0 mm, waist 4.1 mm");
    b.stent = 18;
    EXPECT_EQ(stent_text(b), "18 mm, on its balloon");
    b.deployed = true;
    EXPECT_EQ(stent_text(b), "has left its balloon");
    b.out = 12;
    EXPECT_EQ(stent_text(b), "12 of 18 mm out of its sheath");
    b.burst = true;
    EXPECT_EQ(inflation_text(b), "burst");
}

TEST(Readout, SidesOfTheImageFollowTheView) {
    const auto frontal = render::image_sides(0.0, 0.0);
    EXPECT_EQ(frontal.left, "R");
    EXPECT_EQ(frontal.right, "L");
    EXPECT_EQ(frontal.top, "H");
    // The detector over the patient's left: his back comes in from the right.
    const auto oblique = render::image_sides(30.0 * one_degree, 0.0);
    EXPECT_EQ(oblique.right, "LP");
    EXPECT_EQ(oblique.left, "RA");
    EXPECT_EQ(render::image_sides(90.0 * one_degree, 0.0).right, "P");
    // From over the head the upper edge shows what lies behind.
    EXPECT_EQ(render::image_sides(0.0, 30.0 * one_degree).top, "HP");
    EXPECT_EQ(render::image_sides(nan, 0.0).left, "");
}

}  // namespace
