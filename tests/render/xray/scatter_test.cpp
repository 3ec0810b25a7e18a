#include "render/xray/scatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <random>

namespace {

using render::Field;
using render::Material;

constexpr int n = 47, centre = 23 * n + 23;

/// Scatter over primary in the middle of a square field behind a slab.
double modelled(double thickness, double half_width, double behind, double kvp = 80) {
    const Field scatter = render::scatter_field(Field(n, n, 1.0f), Field(n, n, static_cast<float>(thickness)),
                                                kvp, 2 * half_width / n, behind);
    return scatter.values[centre];
}

/// μ of lead [1/mm]: J. H. Hubbell and S. M. Seltzer, NIST Standard Reference Database 126, 11.35 g/cm³.
double lead(double energy) {
    constexpr double table[][2] = {{15, 111.6},    {20, 86.36},  {30, 30.32}, {40, 14.36},
                                   {50, 8.041},    {60, 5.021},  {80, 2.419}, {88, 1.910},
                                   {88.01, 7.683}, {100, 5.549}, {150, 2.014}};
    int row = 1;
    while (row < 10 && table[row][0] < energy) ++row;
    const double t = std::log(energy / table[row - 1][0]) / std::log(table[row][0] / table[row - 1][0]);
    return 1.135 * table[row - 1][1] * std::pow(table[row][1] / table[row - 1][1], t);
}

/// Transmission of a grid with ratio 13 and 70 strips of 0.036 mm lead per cm for a ray that is slanted by so
/// much across the strips (dx/dz) and has a length of 1/cosine per depth.
double grid_transmission(double slant, double cosine, double energy) {
    constexpr double gap = 0.107, strip = 0.036, period = gap + strip, height = 13 * gap;
    constexpr int phases = 16;
    const double mu = lead(energy);
    const auto lead_before = [&](double x) {
        const double whole = std::floor(x / period);
        return whole * strip + std::max(0.0, x - whole * period - gap);
    };
    double sum = 0;
    for (int k = 0; k < phases; ++k) {
        const double x = (k + 0.5) / phases * period;
        const double deep = slant < 1e-9 ? (x > gap ? height : 0)
                                         : (lead_before(x + height * slant) - lead_before(x)) / slant;
        sum += std::exp(-mu * deep / cosine) / phases;
    }
    return sum;
}

/// Total cross-section of an electron after Klein and Nishina [cm²].
double cross_section(double energy) {
    const double a = energy / 511, l = std::log(1 + 2 * a);
    return 4.98933e-25 * ((1 + a) / (a * a) * (2 * (1 + a) / (1 + 2 * a) - l / a) + l / (2 * a) -
                          (1 + 3 * a) / ((1 + 2 * a) * (1 + 2 * a)));
}

/// The same by following photons: scatter at half widths w of the field over primary, both behind the grid,
/// in the middle of a square field behind a slab of soft tissue. Free electrons scatter; what tables give
/// beyond them counts as absorbed, coherent scatter among it, a twentieth of all.
std::array<double, 3> followed(double thickness, double gap, double kvp, const std::array<double, 3>& widths,
                               int photons, std::uint64_t seed) {
    constexpr double electrons = 1.06 * 3.313e23;  // of soft tissue [1/cm³]; ICRU-44: Z/A 0.550
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    const auto counted = [](double energy, double cosine) {
        return energy * (1 - std::exp(-render::attenuation(Material::CaesiumIodide, energy) * 0.45 / cosine));
    };
    const auto tissue = [](double energy) { return render::attenuation(Material::SoftTissue, energy); };
    std::vector<double> energies, sums;
    double all = 0, primary = 0;
    for (double energy = 20.25; energy < kvp; energy += 0.5) {
        const double fraction = (kvp - energy) / energy *
                                std::exp(-render::attenuation(Material::Aluminium, energy) * 2.5 -
                                         render::attenuation(Material::Copper, energy) * 0.2);
        energies.push_back(energy);
        sums.push_back(all += fraction);
        primary += fraction * counted(energy, 1) * std::exp(-tissue(energy) * thickness);
    }
    primary *= grid_transmission(0, 1, 60) / all;
    std::array<double, 3> result{};
    for (int photon = 0; photon < photons; ++photon) {
        const auto which = std::lower_bound(sums.begin(), sums.end(), uniform(random) * all);
        double energy = energies[std::min<std::size_t>(which - sums.begin(), energies.size() - 1)];
        double mu = tissue(energy);
        // Each photon meets something; its weight is the chance of that.
        double weight = 1 - std::exp(-mu * thickness);
        double x = 0, y = 0, z = -std::log(1 - uniform(random) * weight) / mu;
        double ux = 0, uy = 0, uz = 1;
        while (true) {
            weight *= std::min(1.0, cross_section(energy) * electrons / 10 / mu);
            if (weight < 0.02) {
                if (uniform(random) > 0.2) break;
                weight *= 5;
            }
            const double a = energy / 511;
            double cosine, ratio;
            do {
                cosine = 2 * uniform(random) - 1;
                ratio = 1 / (1 + a * (1 - cosine));
            } while (uniform(random) > 0.5 * ratio * ratio * (ratio + 1 / ratio - 1 + cosine * cosine));
            energy *= ratio;
            if (energy < 15) break;
            const double sine = std::sqrt(1 - cosine * cosine), turn = 2 * std::numbers::pi * uniform(random);
            const double q = std::sqrt(std::max(1e-12, 1 - uz * uz));
            const double vx = q < 1e-5
                                  ? sine * std::cos(turn)
                                  : sine * (ux * uz * std::cos(turn) - uy * std::sin(turn)) / q + ux * cosine;
            const double vy = q < 1e-5
                                  ? sine * std::sin(turn)
                                  : sine * (uy * uz * std::cos(turn) + ux * std::sin(turn)) / q + uy * cosine;
            uz = q < 1e-5 ? std::copysign(cosine, uz * cosine) : -sine * std::cos(turn) * q + uz * cosine;
            ux = vx, uy = vy;
            mu = tissue(energy);
            if (uz > 1e-3) {
                // Its chance to leave from here, and where it arrives.
                const double out = weight * std::exp(-mu * (thickness - z) / uz) * counted(energy, uz) *
                                   grid_transmission(std::abs(ux / uz), uz, energy);
                const double to = thickness - z + gap;
                const double away = std::max(std::abs(x + ux / uz * to), std::abs(y + uy / uz * to));
                for (int k = 0; k < 3; ++k)
                    if (away < widths[k]) result[k] += out;
            }
            const double step = -std::log(1 - uniform(random)) / mu;
            x += ux * step, y += uy * step, z += uz * step;
            if (z < 0 || z > thickness) break;
        }
    }
    for (double& value : result) value /= photons * primary;
    return result;
}

}  // namespace

TEST(Scatter, IsThatOfPhotonsFollowedThroughSlabAndGrid) {
    constexpr std::array<double, 3> widths = {50, 100, 150};
    for (const double thickness : {60.0, 150.0, 250.0}) {
        for (const double behind : {250.0, 450.0}) {
            for (const double kvp : {70.0, 90.0, 110.0}) {
                constexpr std::uint64_t seed = 3;
                const std::array<double, 3> truth =
                    followed(thickness, behind - 0.5 * thickness, kvp, widths, 25000, seed);
                for (int k = 0; k < 3; ++k)
                    EXPECT_NEAR(modelled(thickness, widths[k], behind, kvp), truth[k], 0.01 + 0.2 * truth[k])
                        << thickness << " mm, " << behind << " mm, " << kvp << " kV, field " << 2 * widths[k]
                        << " mm: " << truth[k];
            }
        }
    }
}

TEST(Scatter, IsNothingWithoutAPatientAndGrowsWithThicknessAndField) {
    for (const float value : render::scatter_field(Field(n, n, 1.0f), Field(n, n), 80, 300.0 / n, 350).values)
        ASSERT_EQ(value, 0.0f);
    double before = 0;
    for (const double thickness : {1.0, 20.0, 60.0, 110.0, 160.0, 200.0, 260.0, 300.0, 360.0, 400.0}) {
        const double ratio = modelled(thickness, 100, 350);
        EXPECT_GT(ratio, before) << thickness;
        before = ratio;
    }
    EXPECT_LT(modelled(1, 100, 350), 0.02);
    double narrower = 0;
    for (const double half : {1.0, 5.0, 25.0, 50.0, 100.0, 150.0, 240.0}) {
        const double ratio = modelled(200, half, 350);
        EXPECT_GT(ratio, narrower) << half;
        narrower = ratio;
    }
    EXPECT_LT(modelled(200, 100, 550), modelled(200, 100, 250)) << "a gap of air lets scatter pass by";
    for (const double wild : {-5.0, 1e9}) {
        const double ratio = modelled(wild, 100, 350);
        EXPECT_TRUE(std::isfinite(ratio) && ratio >= 0) << wild;
    }
    EXPECT_TRUE(std::isfinite(modelled(200, 100, 1.0)));
}

TEST(Scatter, SpreadsFromThickPartsToThinOnesAndLosesWhatLeavesTheField) {
    Field primary(n, n, 1.0f), thickness(n, n);
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n / 2; ++i) {
            thickness.values[j * n + i] = 220.0f;
            primary.values[j * n + i] = 0.02f;
        }
    const Field scatter = render::scatter_field(primary, thickness, 80, 300.0 / n, 350);
    const double inside = scatter.values[23 * n + 10], rim = scatter.values[23 * n + 23],
                 outside = scatter.values[23 * n + 40];
    EXPECT_GT(inside, 1.4 * rim);
    EXPECT_GT(rim, 2 * outside);
    EXPECT_GE(outside, 0);
    EXPECT_LT(scatter.values[10], inside) << "no patient beyond the edge of the field scatters";
}

TEST(Scatter, IsEstimatedFromTheMeasuredImage) {
    // Soft tissue of 160 to 260 mm, with noise.
    const render::EnergyBins bins = render::fit_bins(render::detected_spectrum(80));
    const render::Bins mu = bins.attenuation(Material::SoftTissue);
    constexpr int size = 96;
    constexpr double pixel = 300.0 / size;
    std::mt19937 random(4);
    std::normal_distribution<float> noise(0, 0.03f);
    Field primary(size, size), thickness(size, size);
    for (int j = 0; j < size; ++j) {
        for (int i = 0; i < size; ++i) {
            const double t = 160 + 100.0 * i / size;
            double passed = 0;
            for (int k = 0; k < render::energy_bins; ++k) passed += bins.weights[k] * std::exp(-mu[k] * t);
            thickness.values[j * size + i] = static_cast<float>(t);
            primary.values[j * size + i] = static_cast<float>(passed);
        }
    }
    const Field scatter = render::scatter_field(primary, thickness, 80, pixel, 350);
    Field seen = primary;
    for (std::size_t i = 0; i < seen.values.size(); ++i)
        seen.values[i] = (seen.values[i] + scatter.values[i]) * (1 + noise(random));
    const Field lit(size, size, 1.0f), open(size, size, 1.0f);
    const Field estimate = render::estimated_scatter(seen, lit, open, 80, pixel, 350);
    for (int j = 8; j < size - 8; ++j)
        for (int i = 8; i < size - 8; ++i)
            ASSERT_NEAR(estimate.values[j * size + i] / scatter.values[j * size + i], 1.0, 0.08)
                << i << ' ' << j;
    // Broken pixels, nothing at all and an open beam.
    seen.values[5] = std::numeric_limits<float>::quiet_NaN();
    seen.values[6] = -3.0f;
    for (const Field& any : {seen, Field(size, size), open, Field(size, size, 50.0f)})
        for (const float value : render::estimated_scatter(any, lit, open, 80, pixel, 350).values)
            ASSERT_TRUE(std::isfinite(value) && value >= 0);
    for (const float value : render::estimated_scatter(open, lit, open, 80, pixel, 350).values)
        ASSERT_LT(value, 0.01f) << "nothing scatters in the open beam";
    for (const float value : render::estimated_scatter(seen, Field(size, size), open, 80, pixel, 350).values)
        ASSERT_EQ(value, 0.0f) << "a closed collimator";
}
