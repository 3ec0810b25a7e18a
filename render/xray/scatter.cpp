#include "render/xray/scatter.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "render/picture/filter.h"

namespace render {
namespace {

/// Weights of both Gaussians averaged over pixels, the middle one first; nothing beyond `reach` pixels.
std::vector<float> fractions_of(const ScatterWidth& width, double pixel, int reach) {
    const auto below = [&](double x, double sigma) {
        return 0.5 * std::erf(x * pixel / (sigma * std::numbers::sqrt2));
    };
    const auto gaussian = [&](int k, double sigma) { return below(k + 0.5, sigma) - below(k - 0.5, sigma); };
    std::vector<float> fractions;
    for (int k = 0; k < reach; ++k)
        fractions.push_back(static_cast<float>(width.narrow_fraction * gaussian(k, width.narrow) +
                                               (1.0 - width.narrow_fraction) * gaussian(k, width.wide)));
    return fractions;
}

/// Spreads what is in the field; what leaves it is lost, and nothing comes from outside.
Field spread(const Field& field, const ScatterSpread& by, double pixel) {
    const int width = field.width, height = field.height;
    const std::vector<float> x = fractions_of(by.across, pixel, width),
                             y = fractions_of(by.along, pixel, height);
    // Weights of column i from column k stand at width − 1 + k − i, so that the inner loops have no branch.
    std::vector<float> mirrored(2 * static_cast<std::size_t>(width) - 1);
    for (int k = -(width - 1); k < width; ++k) mirrored[width - 1 + k] = x[std::abs(k)];
    Field rows(width, height), result(width, height);
    const auto row = [width](Field& of, int j) {
        return of.values.data() + static_cast<std::size_t>(j) * width;
    };
    for (int j = 0; j < height; ++j) {
        float* const to = row(rows, j);
        for (int from = 0; from < width; ++from) {
            const float value = field.values[static_cast<std::size_t>(j) * width + from];
            const float* const weight = mirrored.data() + width - 1 - from;
            if (value == 0.0f) continue;
            for (int i = 0; i < width; ++i) to[i] += weight[i] * value;
        }
    }
    for (int j = 0; j < height; ++j) {
        float* const to = row(result, j);
        for (int from = 0; from < height; ++from) {
            const float weight = y[std::abs(j - from)];
            const float* const own = row(rows, from);
            for (int i = 0; i < width; ++i) to[i] += weight * own[i];
        }
    }
    return result;
}

}  // namespace

ScatterSpread scatter_spread(double thickness, double gap, double kvp) {
    const double t = std::clamp(thickness, 0.0, 400.0), g = std::clamp(gap, 0.0, 1000.0);
    // Strips of lead let more pass at higher voltage, and in more directions.
    const double over = kvp - 70.0;
    const double first = 0.64e-3 + (over > 0.0 ? 18.3e-6 : 11e-6) * over;
    const double second = 2.65e-6 + (over > 0.0 ? 0.126e-6 : 0.085e-6) * over;
    const double u = std::clamp((kvp - 90.0) / 20.0, -1.75, 1.0);
    const double narrow_fraction =
        0.40 + u * (-0.165 + 0.095 * u) - t * (0.0006 + u * (-0.0003 + 0.0002 * u));
    ScatterSpread result;
    result.per_primary = t * (first + second * t);
    result.across = {std::clamp(narrow_fraction, 0.1, 0.9),
                     (1.0 + 0.17 * u) * (4.0 + 0.03 * g + 0.035 * t + 8e-5 * g * t),
                     std::hypot((1.0 + 0.1 * u) * (28.0 + 0.21 * t), g * (0.55 + 0.08 * u - 0.0002 * t))};
    result.along = {0.57, std::hypot(18.0 + 0.15 * t, 0.46 * g), std::hypot(50.0 + 0.22 * t, 0.9 * g)};
    return result;
}

Field scatter_field(const Field& primary, const Field& thickness, double kvp, double pixel, double behind) {
    assert(primary.values.size() == thickness.values.size());
    // Rays are grouped by thickness; between two of these a ray belongs to both.
    constexpr std::array<double, 4> groups = {60.0, 160.0, 260.0, 360.0};  // [mm]
    constexpr double apart = groups[1] - groups[0];
    constexpr double least_gap = 20.0;  // between patient and detector [mm]
    Field result(primary.width, primary.height);
    for (std::size_t g = 0; g < groups.size(); ++g) {
        const double gap = std::max(behind - 0.5 * groups[g], least_gap);
        Field own(primary.width, primary.height);
        bool any = false;
        for (std::size_t i = 0; i < own.values.size(); ++i) {
            const double t = thickness.values[i];
            const double place = std::clamp((t - groups.front()) / apart, 0.0, groups.size() - 1.0);
            const double fraction = 1.0 - std::abs(place - static_cast<double>(g));
            if (!(fraction > 0.0) || !(t > 0.0)) continue;
            own.values[i] =
                static_cast<float>(fraction * scatter_spread(t, gap, kvp).per_primary) * primary.values[i];
            any = true;
        }
        if (!any) continue;
        const ScatterSpread wide = scatter_spread(groups[g], gap, kvp);
        const Field spread_out = spread(own, wide, pixel);
        for (std::size_t i = 0; i < result.values.size(); ++i) result.values[i] += spread_out.values[i];
    }
    return result;
}

namespace {

/// Thickness of soft tissue by the fraction of the beam that it lets through.
class TissueScale {
public:
    explicit TissueScale(const EnergyBins& bins) {
        const Bins mu = bins.attenuation(Material::SoftTissue);
        for (int i = 0; i < steps; ++i) {
            double passed = 0.0;
            for (int k = 0; k < energy_bins; ++k) passed += bins.weights[k] * std::exp(-mu[k] * step * i);
            passed_[i] = std::log(passed);
        }
    }
    /// Straight lines in the logarithm; from 0 to the end of the scale [mm].
    double thickness(double fraction) const {
        const double wanted = std::log(std::max(fraction, 1e-12));
        const auto at = std::upper_bound(passed_.begin() + 1, passed_.end() - 1, wanted, std::greater<>());
        const double t = (at[-1] - wanted) / (at[-1] - at[0]);
        return step * (static_cast<double>(at - passed_.begin()) - 1.0 + std::clamp(t, 0.0, 1.0));
    }

private:
    static constexpr int steps = 151;
    static constexpr double step = 4.0;  // [mm]
    std::array<double, steps> passed_{};
};

}  // namespace

Field estimated_scatter(const Field& signal, const Field& lit, const Field& open, double kvp, double pixel,
                        double behind) {
    assert(signal.values.size() == open.values.size() && signal.values.size() == lit.values.size());
    constexpr int places = 48, rounds = 6;
    const int block = std::max(1, signal.width / places);
    Field seen = signal, lit_by = open;
    for (std::size_t i = 0; i < seen.values.size(); ++i) {
        seen.values[i] = std::max(0.0f, seen.values[i]) * lit.values[i];  // also replaces NaN
        lit_by.values[i] *= lit.values[i];
    }
    seen = shrink(seen, block);
    lit_by = shrink(lit_by, block);

    const TissueScale scale(fit_bins(detected_spectrum(kvp)));
    Field primary = seen, thickness(seen.width, seen.height), scatter(seen.width, seen.height);
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t i = 0; i < primary.values.size(); ++i) {
            const float all = primary.values[i] + scatter.values[i];
            if (!(all > 0.0f && lit_by.values[i] > 0.0f)) continue;
            primary.values[i] *= seen.values[i] / all;
            thickness.values[i] = static_cast<float>(
                scale.thickness(static_cast<double>(primary.values[i]) / lit_by.values[i]));
        }
        scatter = scatter_field(primary, thickness, kvp, pixel * block, behind);
    }
    return enlarge(scatter, block, signal.width, signal.height);
}

}  // namespace render
