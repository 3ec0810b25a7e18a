#include <cmath>
#include <complex>
#include <cstdio>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/patient/patient.h"
#include "render/patient/patient_parts.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/texture_blobs.h"

namespace {

using geometry::Vec3;
using render::CArm;
using render::Field;
using render::TissueLayer;

constexpr int texture_pixels = 256;
constexpr double texture_pixel = 0.5;  // at the isocentre [mm]

/// The middle 128 mm of a body, seen from an angle [rad].
CArm texture_view(double lao, double cranial) {
    CArm arm{.lao = lao, .cranial = cranial, .pixels = texture_pixels};
    arm.detector_width = texture_pixel * texture_pixels * arm.sid / arm.sod;
    return arm;
}

std::vector<TissueLayer> make_textured_body(std::uint64_t seed) {
    render::PatientSpec spec;
    spec.lower = {-60, -60, -60};
    spec.upper = {60, 60, 60};
    spec.seed = seed;
    return render::make_patient(spec);
}
/// Made once for all tests of a process.
const std::vector<TissueLayer>& textured_body(std::uint64_t seed) {
    static std::map<std::uint64_t, std::vector<TissueLayer>> made;
    const auto at = made.find(seed);
    return at != made.end() ? at->second : made[seed] = make_textured_body(seed);
}

Field lumps_of(const std::vector<TissueLayer>& layers, const CArm& arm) {
    Field sum(arm.pixels, arm.pixels);
    for (const TissueLayer& layer : layers)
        if (layer.name == "trunk") render::add_lengths(layer.texture_blobs, arm, sum);
    return sum;
}

double mean_of(const Field& field) {
    double sum = 0;
    for (const float value : field.values) sum += value;
    return sum / static_cast<double>(field.values.size());
}

/// The exponent β of a power spectrum ∝ f^(−β): a straight line through the logarithms of radial means from
/// 0.05 to 0.5 cycles/mm, under a Hann window.
double exponent_of(const Field& field) {
    constexpr int n = texture_pixels;
    constexpr double lowest = 0.05, highest = 0.5, length = n * texture_pixel;
    constexpr int most = static_cast<int>(highest * length);
    const double mean = mean_of(field);
    using Complex = std::complex<double>;
    std::vector<Complex> turns;
    for (int k = 0; k < n; ++k) turns.push_back(std::polar(1.0, -2.0 * std::numbers::pi * k / n));
    const auto window = [](int i) { return 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (i + 0.5) / n); };
    std::vector<Complex> rows(static_cast<std::size_t>(n) * (most + 1));
    for (int j = 0; j < n; ++j)
        for (int k = 0; k <= most; ++k) {
            Complex sum = 0;
            for (int i = 0; i < n; ++i)
                sum +=
                    window(i) * (field.values[static_cast<std::size_t>(j) * n + i] - mean) * turns[i * k % n];
            rows[static_cast<std::size_t>(j) * (most + 1) + k] = window(j) * sum;
        }
    constexpr int bins = 12;
    std::vector<double> power(bins, 0), count(bins, 0);
    for (int k = 0; k <= most; ++k)
        for (int m = -most; m <= most; ++m) {
            const double f = std::hypot(k, m) / length;
            if (f < lowest || f >= highest) continue;
            Complex sum = 0;
            for (int j = 0; j < n; ++j)
                sum += rows[static_cast<std::size_t>(j) * (most + 1) + k] * turns[(m + n) * j % n];
            const int bin = static_cast<int>(bins * std::log(f / lowest) / std::log(highest / lowest));
            power[bin] += std::norm(sum);
            ++count[bin];
        }
    double x = 0, y = 0, xx = 0, xy = 0;
    for (int bin = 0; bin < bins; ++bin) {
        const double at = (bin + 0.5) / bins * std::log(highest / lowest),
                     value = std::log(power[bin] / count[bin]);
        x += at, y += value, xx += at * at, xy += at * value;
    }
    return -(bins * xy - x * y) / (bins * xx - x * x);
}

TEST(PatientTexture, HasTheSpectrumOfAnatomicalNoiseFromAllSides) {
    const auto& layers = textured_body(5);
    for (const auto& [lao, cranial] :
         {std::pair{0.0, 0.0}, {1.57, 0.0}, {0.52, 0.0}, {-0.52, 0.0}, {0.0, 0.44}}) {
        const Field lengths = lumps_of(layers, texture_view(lao, cranial));
        const double beta = exponent_of(lengths), mean = mean_of(lengths);
        double squares = 0;
        for (const float value : lengths.values) squares += std::pow(value - mean, 2);
        const double deviation = std::sqrt(squares / static_cast<double>(lengths.values.size()));
        std::printf("LAO %.2f cranial %.2f: exponent %.2f, mean %.3f mm, deviation %.2f mm\n", lao, cranial,
                    beta, mean, deviation);
        EXPECT_GT(beta, 2.5);
        EXPECT_LT(beta, 3.5);
        EXPECT_NEAR(mean, 0.0, 2.5);  // a few large texture_blobs more on one side: 0.8 % of the signal
        // 1 to 4 % of the signal, for fat and muscle differ by 0.003/mm.
        EXPECT_GT(deviation, 3.0);
        EXPECT_LT(deviation, 13.0);
    }
}

TEST(PatientTexture, HoldsAsMuchMoreAsLessOfTheTissue) {
    for (const std::uint64_t seed : {0, 5, 9}) {
        double sum = 0, all = 0, volume = 0;
        for (const TissueLayer& layer : textured_body(seed)) {
            if (layer.name != "trunk") continue;
            volume += 1;
            for (const render::TextureBlob& blob : layer.texture_blobs) {
                sum += render::content(blob);
                all += std::abs(render::content(blob));
            }
        }
        EXPECT_EQ(volume, 1);
        EXPECT_GT(all, 1e5);
        EXPECT_LT(std::abs(sum), 0.005 * all) << seed;
    }
}

TEST(PatientTexture, LeavesTheMeanOfAnImageAndDiffersWithTheSeedAlone) {
    const auto &layers = textured_body(5), &other = textured_body(6);
    const auto again = make_textured_body(5);
    std::vector<TissueLayer> smooth = layers;
    for (TissueLayer& layer : smooth)
        if (layer.name == "trunk") layer.texture_blobs.clear();
    const CArm arm = texture_view(0, 0);
    EXPECT_EQ(lumps_of(layers, arm).values, lumps_of(again, arm).values);
    EXPECT_NE(lumps_of(layers, arm).values, lumps_of(other, arm).values);
    render::Fluoroscope with({}, layers), without({}, std::move(smooth));
    render::Exposure exposure{.kvp = 75};
    const Field textured = with.expected_quanta(arm, {}, exposure),
                plain = without.expected_quanta(arm, {}, exposure);
    EXPECT_NEAR(mean_of(textured) / mean_of(plain), 1.0, 0.01);
    EXPECT_EQ(with.technique(arm, exposure).current, without.technique(arm, exposure).current);
    Field logarithm = plain;
    for (std::size_t i = 0; i < plain.values.size(); ++i) logarithm.values[i] = std::log(plain.values[i]);
    const double before = exponent_of(logarithm);
    for (std::size_t i = 0; i < plain.values.size(); ++i) logarithm.values[i] = std::log(textured.values[i]);
    const double after = exponent_of(logarithm);
    std::printf("image of the body: exponent %.2f without texture, %.2f with it\n", before, after);
    EXPECT_GT(after, 2.5);
    EXPECT_LT(after, 3.9);  // a CT of the abdomen through the same chain: 3.3 to 3.9
}

TEST(PatientTexture, LiesInFleshOnly) {
    render::PatientSpec spec;
    spec.lower = {-60, -60, 250};
    spec.upper = {60, 60, 640};
    std::size_t count = 0;
    for (const TissueLayer& layer : render::make_patient(spec)) {
        if (layer.name != "trunk") continue;
        Eigen::AlignedBox3d body;
        for (const Vec3& v : layer.mesh.vertices) body.extend(v);
        for (const render::TextureBlob& blob : layer.texture_blobs) {
            const Vec3 p = blob.middle.cast<double>() - spec.origin;
            ASSERT_TRUE(body.contains(blob.middle.cast<double>()));
            // Not in the middle of a lung or of the brain.
            EXPECT_GT((p - Vec3(80, 0, 330)).norm(), 25.0);
            EXPECT_GT((p - Vec3(0, 10, 660)).norm(), 40.0);
            ++count;
        }
    }
    EXPECT_GT(count, 10000u);
}

}  // namespace
