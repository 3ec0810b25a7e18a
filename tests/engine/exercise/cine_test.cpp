/// Cine beside real cine: noise, greys and the depth of contrast.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "engine/run/still.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

/// The image without the part that a collimator may cover.
std::vector<std::vector<double>> middle_of(const render::GrayImage& image) {
    const int margin = image.width * 8 / 100, side = image.width - 2 * margin;
    std::vector<std::vector<double>> rows(static_cast<std::size_t>(side), std::vector<double>(side));
    for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i)
            rows[j][i] = image.pixels[static_cast<std::size_t>(j + margin) * image.width + i + margin];
    return rows;
}

double percentile(std::vector<double> values, double fraction) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * (values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// Standard deviation of the noise after Immerkaer, Computer Vision and Image Understanding 64 (1996) 300.
double noise_of(const std::vector<std::vector<double>>& a) {
    double sum = 0, count = 0;
    for (std::size_t j = 1; j + 1 < a.size(); ++j)
        for (std::size_t i = 1; i + 1 < a.size(); ++i, ++count)
            sum +=
                std::abs(a[j - 1][i - 1] - 2 * a[j - 1][i] + a[j - 1][i + 1] - 2 * a[j][i - 1] + 4 * a[j][i] -
                         2 * a[j][i + 1] + a[j + 1][i - 1] - 2 * a[j + 1][i] + a[j + 1][i + 1]);
    return std::sqrt(std::acos(-1.0) / 2) * sum / count / 6;
}

/// Largest or least of 31 × 31 pixels.
template <class Pick>
std::vector<std::vector<double>> picked(std::vector<std::vector<double>> rows, Pick pick) {
    const int side = static_cast<int>(rows.size());
    for (int pass = 0; pass < 2; ++pass) {
        std::vector<std::vector<double>> turned = rows;
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i) {
                double best = rows[j][i];
                for (int k = std::max(0, i - 15); k <= std::min(side - 1, i + 15); ++k)
                    best = pick(best, rows[j][k]);
                turned[i][j] = best;
            }
        rows = std::move(turned);
    }
    return rows;
}

}  // namespace

// Three frames of one real coronary cine, 512 × 512, have: noise 1.1 grey levels; first and 99th percentile
// 113 and 217; what lies darker than its surroundings of 31 pixels does so by 48 grey levels in its darkest
// half percent.
TEST(Cine, OfACoronaryArteryHasNoiseGreysAndContrastNearThoseOfARealOne) {
    const scenario::Scenario scenario = test::shipped_scenario("coronary_lad");
    script::CommandScript script =
        script::parse_commands("0 mode cine\n0 beam on\n2 inject 5 ml at 4 ml/s into LM\n20 end\n", "x.gw");
    run::StillRequest request;
    request.frame = 12;
    request.lao = -30 * geometry::degree;
    request.cranial = -20 * geometry::degree;
    request.mode = script::ImagingMode::Cine;
    const test::TemporaryFolder folder;
    anatomy::ModelCache cache;
    cache.folder = folder.path().string();
    const auto grey = middle_of(run::render_still(scenario, script, request, cache));
    EXPECT_LE(noise_of(grey), 1.5);
    EXPECT_GE(noise_of(grey), 0.8);
    std::vector<double> all, depths;
    const auto larger = [](double a, double b) { return std::max(a, b); };
    const auto less = [](double a, double b) { return std::min(a, b); };
    const auto around = picked(picked(grey, larger), less);
    for (std::size_t j = 0; j < grey.size(); ++j)
        for (std::size_t i = 0; i < grey.size(); ++i) {
            all.push_back(grey[j][i]);
            depths.push_back(around[j][i] - grey[j][i]);
        }
    EXPECT_NEAR(percentile(all, 0.01), 113, 0.2 * 113);
    EXPECT_NEAR(percentile(all, 0.99), 217, 0.2 * 217);
    EXPECT_NEAR(percentile(depths, 0.995), 48, 0.2 * 48);
}

}  // namespace exercise
