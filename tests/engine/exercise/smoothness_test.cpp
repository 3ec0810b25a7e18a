#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <vector>

#include "engine/exercise/score.h"

namespace exercise {
namespace {

/// The definition, term by term: a plain Fourier sum at each frequency.
double arc_by_sums(const std::vector<double>& speed, double rate) {
    std::size_t length = 1;
    while (length < speed.size()) length *= 2;
    length *= 16;
    const double step = rate / static_cast<double>(length);
    std::vector<double> fraction;
    for (std::size_t k = 0; k <= length / 2 && static_cast<double>(k) * step <= 10; ++k) {
        std::complex<double> sum = 0;
        for (std::size_t n = 0; n < speed.size(); ++n)
            sum += speed[n] * std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k * n % length) /
                                                  static_cast<double>(length));
        fraction.push_back(std::abs(sum));
    }
    double greatest = 0;
    for (const double s : fraction) greatest = std::max(greatest, s);
    std::size_t first = 0, last = fraction.size() - 1;
    while (fraction[first] < 0.05 * greatest) ++first;
    while (fraction[last] < 0.05 * greatest) --last;
    double arc = 0;
    for (std::size_t k = first + 1; k <= last; ++k) {
        const double along = 1.0 / static_cast<double>(last - first),
                     up = (fraction[k] - fraction[k - 1]) / greatest;
        arc += std::sqrt(along * along + up * up);
    }
    return -arc;
}

/// A stroke of minimum jerk, `frames` long.
std::vector<double> stroke(int frames) {
    std::vector<double> speed;
    for (int k = 0; k < frames; ++k) {
        const double t = (k + 0.5) / frames;
        speed.push_back(30 * t * t * (1 - t) * (1 - t));
    }
    return speed;
}

}  // namespace

TEST(Smoothness, SpectralArcIsThatOfThePlainSum) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> value(0, 20);
    for (const int frames : {2, 3, 16, 17, 60, 200}) {
        std::vector<double> speed;
        for (int k = 0; k < frames; ++k) speed.push_back(value(random));
        for (const double rate : {15.0, 30.0, 60.0}) {
            const auto arc = spectral_arc_length(speed, rate);
            ASSERT_TRUE(arc);
            EXPECT_NEAR(*arc, arc_by_sums(speed, rate), 1e-9) << frames << " frames at " << rate;
        }
    }
}

TEST(Smoothness, OneStrokeIsSmootherThanFourAndThanTrembling) {
    const std::vector<double> one = stroke(60);
    std::vector<double> four, trembling = one;
    for (int k = 0; k < 4; ++k)
        for (const double v : stroke(15)) four.push_back(v);
    for (std::size_t k = 0; k < trembling.size(); k += 4) trembling[k] += 0.5;  // 7.5 Hz
    const auto arc = [](const std::vector<double>& v) { return spectral_arc_length(v, 30).value(); };
    const auto jerk = [](const std::vector<double>& v) { return log_dimensionless_jerk(v, 30).value(); };
    EXPECT_GT(arc(one), arc(four));
    EXPECT_GT(arc(one), arc(trembling));
    EXPECT_GT(jerk(one), jerk(four));
    EXPECT_GT(jerk(one), jerk(trembling));
    EXPECT_NEAR(arc(one), -1.41, 0.05);  // near the least that a single stroke has
}

TEST(Smoothness, NeitherDependsOnTheUnitOfSpeed) {
    std::vector<double> speed = stroke(40), scaled;
    for (const double v : speed) scaled.push_back(1000 * v);
    EXPECT_NEAR(*spectral_arc_length(speed, 15), *spectral_arc_length(scaled, 15), 1e-12);
    EXPECT_NEAR(*log_dimensionless_jerk(speed, 15), *log_dimensionless_jerk(scaled, 15), 1e-12);
}

TEST(Smoothness, JerkOfAHandComputedTrace) {
    // v = 0, 1, 4, 1, 0 at 2 frames/s: second differences 2, −6, 2 times 4, so Σ v̈²Δt = (64 + 576 + 64)/2;
    // T = 2.5 s, v_max = 4.
    const std::vector<double> speed = {0, 1, 4, 1, 0};
    EXPECT_NEAR(*log_dimensionless_jerk(speed, 2), -std::log(2.5 * 2.5 * 2.5 / 16 * 352), 1e-12);
}

TEST(Smoothness, WhatHasNoneIsEmpty) {
    const std::vector<double> still(30, 0.0), steady(30, 2.0), one = {1};
    EXPECT_FALSE(spectral_arc_length(still, 15));
    EXPECT_FALSE(spectral_arc_length(one, 15));
    EXPECT_FALSE(spectral_arc_length({}, 15));
    EXPECT_FALSE(log_dimensionless_jerk(still, 15));
    EXPECT_FALSE(log_dimensionless_jerk(steady, 15));
    EXPECT_FALSE(log_dimensionless_jerk(one, 15));
    EXPECT_FALSE(spectral_arc_length(std::vector<double>((1u << 18) + 1, 1.0), 15));
}

}  // namespace exercise
