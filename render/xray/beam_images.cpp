#include "render/xray/beam_images.h"

#include <algorithm>
#include <cmath>

#include "render/picture/fast_exp.h"
#include "render/picture/filter.h"

namespace render {
namespace {

/// Intensity with nothing in the beam, relative to its middle: inverse square and obliquity (cos³), heel
/// effect.
Field flat_field(const CArm& arm, double heel) {
    Field flat(arm.pixels, arm.pixels);
    const double step = pixel_width(arm) / arm.sid;
    for (int j = 0; j < arm.pixels; ++j) {
        const double y = (j + 0.5 - 0.5 * arm.pixels) * step;
        const double toward_head = -(j + 0.5 - 0.5 * arm.pixels) / (0.5 * arm.pixels);
        for (int i = 0; i < arm.pixels; ++i) {
            const double x = (i + 0.5 - 0.5 * arm.pixels) * step;
            const double square = 1.0 + x * x + y * y;
            flat.values[static_cast<std::size_t>(j) * arm.pixels + i] =
                static_cast<float>((1.0 - 0.5 * heel * (1.0 + toward_head)) / (square * std::sqrt(square)));
        }
    }
    return flat;
}

/// 1 in the disc where automatic exposure measures, 0 outside: air around the patient does not count.
Field measuring_field(const CArm& arm, double radius) {
    Field field(arm.pixels, arm.pixels);
    // Has at least one pixel.
    const double reach = std::max(radius * arm.pixels, 1.0);
    for (int j = 0; j < arm.pixels; ++j) {
        for (int i = 0; i < arm.pixels; ++i) {
            const double away = std::hypot(i + 0.5 - 0.5 * arm.pixels, j + 0.5 - 0.5 * arm.pixels);
            field.values[static_cast<std::size_t>(j) * arm.pixels + i] = away <= reach ? 1.0f : 0.0f;
        }
    }
    return field;
}

constexpr double usual_dose = 30.0;  // of a fluoroscopy pulse [nGy]

/// Air kerma of the open beam per detected signal, in the units of kerma_per_signal.
double open_kerma(double kvp) {
    const Spectrum spectrum = detected_spectrum(kvp);
    double sum = 0.0;
    for (std::size_t i = 0; i < spectrum.energies.size(); ++i)
        sum += spectrum.weights[i] * kerma_per_signal(spectrum.energies[i]);
    return sum;
}

/// μ of the mixture's material minus that of its surroundings [1/mm].
PixelBins change_of(const Mixture& mixture, const EnergyBins& bins) {
    const Bins own = bins.attenuation(mixture.material), around = bins.attenuation(mixture.inside);
    PixelBins change;
    for (int k = 0; k < energy_bins; ++k) change[k] = static_cast<float>(own[k] - around[k]);
    return change;
}

}  // namespace

SparseLength::SparseLength(const Field& length) {
    for (std::uint32_t i = 0; i < length.values.size(); ++i) {
        if (!(length.values[i] > 0.0f)) continue;
        pixels.push_back(i);
        lengths.push_back(length.values[i]);
    }
}

PlaneImages plane_images(const FluoroscopeConfig& config, const CArm& arm) {
    return {arm, flat_field(arm, config.heel), shutters(config.display, arm),
            measuring_field(arm, config.measuring_radius)};
}

PoseImages pose_images(PathLengthRenderer& renderer, std::span<const TissueLayer> layers, bool has_nodes,
                       const CArm& arm) {
    PoseImages pose;
    pose.arm = arm;
    const Field nothing(arm.pixels, arm.pixels);
    const auto mixture = [&](const TissueLayer& tissue) -> Field& {
        for (Mixture& m : pose.mixtures)
            if (m.material == tissue.material && m.inside == tissue.inside) return m.length;
        return pose.mixtures.emplace_back(Mixture{tissue.material, tissue.inside, nothing}).length;
    };
    const auto add = [](const Field& length, Field& sum) {
        for (std::size_t i = 0; i < length.values.size(); ++i) sum.values[i] += length.values[i];
    };
    Field contrast;
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        const TissueLayer& tissue = layers[layer];
        const bool mixed = tissue.material != tissue.inside;
        if (!mixed && !tissue.perfused && has_nodes) continue;
        const int mesh = static_cast<int>(layer);
        if (mixed && !tissue.takes_contrast && !tissue.perfused) {
            pose.unbalanced_pixels += renderer.accumulate(mesh, arm, mixture(tissue));
            continue;
        }
        const PathLengthRenderer::Result path = renderer.render(mesh, arm);
        pose.unbalanced_pixels += path.unbalanced_pixels;
        if (mixed) add(path.length, mixture(tissue));
        if (tissue.perfused) pose.organs[mesh] = SparseLength(path.length);
        if (!tissue.takes_contrast) continue;
        if (contrast.values.empty()) contrast = nothing;
        add(path.length, contrast);
    }
    pose.contrast = SparseLength(contrast);
    return pose;
}

void add_length(PoseImages& pose, Material material, Material inside, const Field& length) {
    if (material == inside) return;
    for (Mixture& m : pose.mixtures) {
        if (m.material != material || m.inside != inside) continue;
        for (std::size_t i = 0; i < length.values.size(); ++i) m.length.values[i] += length.values[i];
        return;
    }
    pose.mixtures.push_back({material, inside, length});
}

double charge_per_dose(const FluoroscopeConfig& config, const PlaneImages& plane, const PoseImages& pose,
                       double kvp) {
    const CArm& arm = pose.arm;
    const EnergyBins bins = fit_bins(detected_spectrum(kvp));
    std::vector<PixelBins> change;
    for (const Mixture& m : pose.mixtures) change.push_back(change_of(m, bins));
    constexpr int sampled = 24;  // places along either side
    double kerma = 0.0;
    int places = 0;
    const int step = std::max(1, arm.pixels / sampled);
    for (int j = step / 2; j < arm.pixels; j += step) {
        for (int i = step / 2; i < arm.pixels; i += step) {
            const std::size_t pixel = static_cast<std::size_t>(j) * arm.pixels + i;
            if (plane.measured.values[pixel] == 0.0f) continue;
            ++places;
            for (int k = 0; k < energy_bins; ++k) {
                double exponent = 0.0;
                for (std::size_t m = 0; m < change.size(); ++m)
                    exponent -= change[m][k] * pose.mixtures[m].length.values[pixel];
                kerma += bins.weights[k] * kerma_per_signal(bins.energies[k]) * std::exp(exponent);
            }
        }
    }
    // Never zero: through metres of bone the tube reaches its limit long before.
    const double transmitted =
        std::max((1.0 + config.scatter_to_primary) * kerma / std::max(places, 1), 1e-20);
    const double metres = 1e-3 * arm.sid;
    constexpr double nGy_per_mGy = 1e6;
    return open_kerma(kvp) / transmitted * metres * metres / (kerma_per_charge(kvp) * nGy_per_mGy);
}

BeamImages beam_images(const FluoroscopeConfig& config, const PlaneImages& plane, const PoseImages& pose,
                       const std::optional<double>& kvp) {
    BeamImages result;
    const CArm& arm = pose.arm;
    // The voltage belongs to the usual dose, so that a change of dose does not change the contrast.
    result.kvp = kvp ? *kvp : automatic_exposure([&](double kv) {
                                  return usual_dose * charge_per_dose(config, plane, pose, kv);
                              }).kvp;
    result.bins = fit_bins(detected_spectrum(result.kvp));

    std::vector<PixelBins> changes;
    for (const Mixture& m : pose.mixtures) changes.push_back(change_of(m, result.bins));
    const std::size_t count = plane.flat.values.size();
    result.primary.resize(count);
    Field relative(arm.pixels, arm.pixels), lit(arm.pixels, arm.pixels);
    // Row by row, so that a row's exponents, bins of a pixel side by side, stay in the cache.
    const std::size_t row = static_cast<std::size_t>(arm.pixels);
    std::vector<float> exponents(row * energy_bins);
    for (std::size_t start = 0; start < count; start += row) {
        std::fill(exponents.begin(), exponents.end(), 0.0f);
        for (std::size_t m = 0; m < changes.size(); ++m) {
            const float* length = pose.mixtures[m].length.values.data() + start;
            for (std::size_t i = 0; i < row; ++i)
                for (int k = 0; k < energy_bins; ++k)
                    exponents[i * energy_bins + k] -= changes[m][k] * length[i];
        }
        exponentiate(exponents);
        for (std::size_t i = 0; i < row; ++i) {
            const std::size_t pixel = start + i;
            for (int k = 0; k < energy_bins; ++k) {
                result.primary[pixel][k] = plane.flat.values[pixel] *
                                           static_cast<float>(result.bins.weights[k]) *
                                           exponents[i * energy_bins + k];
            }
            relative.values[pixel] = sum(result.primary[pixel]);
            lit.values[pixel] = plane.open.values[pixel] * relative.values[pixel];
        }
    }

    // Scatter: the primary image spread wide. What the collimator blocks does not scatter.
    const int block = std::max(1, arm.pixels / 64);
    result.scatter =
        enlarge(gaussian_blur(shrink(lit, block), config.scatter_reach / pixel_width(arm) / block), block,
                arm.pixels, arm.pixels);
    for (float& value : result.scatter.values) value *= static_cast<float>(config.scatter_to_primary);

    // Automatic exposure: one nGy on average in the measuring field; each frame scales it to its dose.
    double field = 0.0, received = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        field += plane.measured.values[i];
        received +=
            static_cast<double>(plane.measured.values[i]) * (relative.values[i] + result.scatter.values[i]);
    }
    const double quanta = quanta_per_dose_and_area * pixel_width(arm) * pixel_width(arm);
    result.gain = received > 0.0 ? quanta * field / received : 0.0;
    return result;
}

}  // namespace render
