#include "render/xray/detector.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

namespace {

using render::Field;

struct Moments {
    double mean = 0.0, variance = 0.0, neighbours = 0.0;  // the last: correlation of pixels side by side
};
Moments moments(const Field& field) {
    Moments m;
    const double count = static_cast<double>(field.values.size());
    for (float v : field.values) m.mean += v / count;
    for (float v : field.values) m.variance += (v - m.mean) * (v - m.mean) / count;
    for (std::size_t i = 1; i < field.values.size(); ++i) {
        m.neighbours += (field.values[i] - m.mean) * (field.values[i - 1] - m.mean) / count / m.variance;
    }
    return m;
}

constexpr render::DetectorSpec only_quanta{0.0, 0.0};

TEST(Detector, NoiseHasTheVarianceOfAPoissonCount) {
    // Over 640² pixels the variance is known to sqrt(2/N) = 0.22 %, (1.3 % for 2 quanta, whose kurtosis is
    // higher: 0.25 %); a percent is four deviations.
    for (float mean : {2.0f, 9.0f, 24.0f, 26.0f, 54.0f, 220.0f, 900.0f}) {
        const Moments m = moments(render::read_out(Field(640, 640, mean), 0.29, only_quanta, 7, 3));
        EXPECT_NEAR(m.mean / mean, 1.0, 0.005) << mean;
        EXPECT_NEAR(m.variance / mean, 1.0, 0.01) << mean;
        EXPECT_NEAR(m.neighbours, 0.0, 0.006) << mean;
    }
}

TEST(Detector, CountsOfFewQuantaAreDistributedLikePoissons) {
    // The fraction of counts up to each number: 300 000 counts stray by 0.003 at most, three times in four
    // thousand (Kolmogorov).
    for (const float mean : {0.5f, 3.9f, 4.0f, 6.5f, 12.0f, 24.9f}) {
        std::vector<double> seen(80, 0.0);
        const Field counted = render::read_out(Field(548, 548, mean), 0.29, only_quanta, 2, 6);
        for (const float v : counted.values) ++seen[static_cast<std::size_t>(std::min(v, 79.0f))];
        double term = std::exp(-static_cast<double>(mean)), expected = 0, found = 0;
        for (int k = 0; k < 80; term *= mean / ++k) {
            expected += term;
            found += seen[k] / static_cast<double>(counted.values.size());
            ASSERT_NEAR(found, expected, 0.0035) << mean << ", up to " << k;
        }
    }
}

TEST(Detector, FewQuantaAreWholeNumbers) {
    const Field counted = render::read_out(Field(64, 64, 4.0f), 0.29, only_quanta, 1, 1);
    int zeros = 0;
    for (float v : counted.values) {
        EXPECT_EQ(v, std::round(v));
        zeros += v == 0.0f;
    }
    EXPECT_NEAR(zeros / 4096.0, std::exp(-4.0), 0.01);
}

TEST(Detector, ThirtyNanograyAre54QuantaInAPixelOf290Micrometres) {
    EXPECT_NEAR(render::quanta_per_dose_and_area * 30.0 * 0.29 * 0.29, 54.0, 1e-9);
}

TEST(Detector, BlursTheQuantumNoiseButNotTheElectronicNoise) {
    const Moments sharp = moments(render::read_out(Field(512, 512, 54.0f), 0.29, {0.0, 0.0}, 5, 5));
    const Moments blurred = moments(render::read_out(Field(512, 512, 54.0f), 0.29, {0.3, 0.0}, 5, 5));
    EXPECT_LT(blurred.variance, 0.3 * sharp.variance);
    EXPECT_GT(blurred.neighbours, 0.5);
    const Moments electronic = moments(render::read_out(Field(512, 512, 0.0f), 0.29, {0.3, 6.0}, 5, 5));
    EXPECT_NEAR(electronic.variance, 36.0, 0.4);
    EXPECT_NEAR(electronic.neighbours, 0.0, 0.008);
}

TEST(Detector, NoiseIsAFunctionOfSeedAndFrame) {
    const Field expected(64, 64, 54.0f);
    const auto at = [&](std::uint64_t seed, std::uint64_t frame) {
        return render::read_out(expected, 0.29, {}, seed, frame).values;
    };
    EXPECT_EQ(at(1, 2), at(1, 2));
    EXPECT_NE(at(1, 2), at(1, 3));
    EXPECT_NE(at(1, 2), at(2, 2));
    EXPECT_NE(at(1, 2), at(2, 1));
    // Frames that follow each other are not alike.
    double together = 0.0;
    const auto a = at(1, 2), b = at(1, 3);
    for (std::size_t i = 0; i < a.size(); ++i) together += (a[i] - 54.0) * (b[i] - 54.0) / 54.0 / a.size();
    EXPECT_NEAR(together, 0.0, 0.06);
}

TEST(Detector, StandsNothingAndNaN) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(render::PixelNoise::quanta(0.0f, 1), 0.0f);
    EXPECT_EQ(render::PixelNoise::quanta(-3.0f, 1), 0.0f);
    EXPECT_EQ(render::PixelNoise::quanta(nan, 1), 0.0f);
}

}  // namespace
