#include "render/xray/beam_images.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/picture/fast_math.h"
#include "render/picture/filter.h"
#include "render/xray/exposure_meter.h"

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

}  // namespace

PixelBins change_of(const Mixture& mixture, const EnergyBins& bins) {
    const Bins own = bins.attenuation(mixture.material), around = bins.attenuation(mixture.inside);
    PixelBins change;
    for (int k = 0; k < energy_bins; ++k) change[k] = static_cast<float>(own[k] - around[k]);
    return change;
}

Field measuring_disc(const CArm& arm, double radius) {
    Field field(arm.pixels, arm.pixels);
    // Has at least one pixel.
    const double reach = std::max(radius / pixel_width(arm), 1.0);
    for (int j = 0; j < arm.pixels; ++j) {
        for (int i = 0; i < arm.pixels; ++i) {
            const double away = std::hypot(i + 0.5 - 0.5 * arm.pixels, j + 0.5 - 0.5 * arm.pixels);
            field.values[static_cast<std::size_t>(j) * arm.pixels + i] = away <= reach ? 1.0f : 0.0f;
        }
    }
    return field;
}

Field scattering_thickness(std::span<const Mixture> mixtures, int pixels) {
    Field thickness(pixels, pixels);
    for (const Mixture& m : mixtures) {
        const auto change = static_cast<float>(scattering(m.material) - scattering(m.inside));
        for (std::size_t i = 0; i < thickness.values.size(); ++i)
            thickness.values[i] += change * m.length.values[i];
    }
    return thickness;
}

SparseLength::SparseLength(const Field& length) {
    for (std::uint32_t i = 0; i < length.values.size(); ++i) {
        if (!(length.values[i] > 0.0f)) continue;
        pixels.push_back(i);
        lengths.push_back(length.values[i]);
    }
}

PlaneImages plane_images(const FluoroscopeConfig& config, const CArm& arm) {
    return {arm, flat_field(arm, config.heel), shutters(config.display, arm),
            measuring_disc(arm, config.measuring_radius * arm.detector_width)};
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
            Field& length = mixture(tissue);
            renderer.accumulate(mesh, arm, length);
            add_lengths(tissue.texture_blobs, arm, length);
            continue;
        }
        PathLengthRenderer::Result path = renderer.render(mesh, arm);
        add_lengths(tissue.texture_blobs, arm, path.length);
        if (mixed) add(path.length, mixture(tissue));
        if (tissue.perfused) pose.organs[mesh] = SparseLength(path.length);
        if (!tissue.takes_contrast) continue;
        if (contrast.values.empty()) contrast = nothing;
        add(path.length, contrast);
    }
    pose.contrast = SparseLength(contrast);
    return pose;
}

void add_length(std::vector<Mixture>& mixtures, Material material, Material inside, const Field& length) {
    if (material == inside) return;
    for (Mixture& m : mixtures) {
        if (m.material != material || m.inside != inside) continue;
        for (std::size_t i = 0; i < length.values.size(); ++i) m.length.values[i] += length.values[i];
        return;
    }
    mixtures.push_back({material, inside, length});
}

SmallBlur::SmallBlur(const Eigen::Matrix2d& covariance)
    : middle(static_cast<float>(1 - covariance.trace())),
      across(static_cast<float>(0.5 * covariance(0, 0))),
      down(static_cast<float>(0.5 * covariance(1, 1))),
      falling(static_cast<float>(0.25 * covariance(0, 1))) {}

Eigen::Matrix2d focal_blur(const CArm& arm, double focal_spot, double depth) {
    const double side = focal_spot * (arm.sid / depth - 1) / pixel_width(arm);
    return side * side / 12 * Eigen::Matrix2d::Identity();
}

namespace {

/// In place, by the kernel without diagonals; the border keeps its own values.
void blur(std::vector<PixelBins>& image, int width, const SmallBlur& kernel) {
    const int height = static_cast<int>(image.size()) / width;
    std::vector<PixelBins> before(image.begin(), image.begin() + width), row(before.size());
    for (int j = 1; j + 1 < height; ++j) {
        PixelBins* const here = image.data() + static_cast<std::ptrdiff_t>(j) * width;
        std::copy_n(here, width, row.begin());
        for (int i = 1; i + 1 < width; ++i)
            for (int k = 0; k < energy_bins; ++k)
                here[i][k] = kernel.middle * row[i][k] + kernel.across * (row[i - 1][k] + row[i + 1][k]) +
                             kernel.down * (before[i][k] + here[i + width][k]);
        std::swap(before, row);
    }
}

}  // namespace

BeamImages beam_images(const PlaneImages& plane, const PoseImages& pose, double kvp, double focal_spot,
                       Field scatter) {
    BeamImages result;
    const CArm& arm = pose.arm;
    result.kvp = kvp;
    result.bins = fit_bins(detected_spectrum(result.kvp));

    std::vector<PixelBins> changes;
    for (const Mixture& m : pose.mixtures) changes.push_back(change_of(m, result.bins));
    const std::size_t count = plane.flat.values.size();
    result.primary.resize(count);
    result.scatter = std::move(scatter);
    Field received(arm.pixels, arm.pixels);
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
            result.scatter.values[pixel] *= plane.flat.values[pixel];
            received.values[pixel] = sum(result.primary[pixel]) + result.scatter.values[pixel];
        }
    }

    blur(result.primary, arm.pixels, SmallBlur(focal_blur(arm, focal_spot, arm.sod)));

    // Automatic exposure: one nGy on average in the measuring field; each frame scales it to its dose.
    Field disc = plane.measured;
    for (std::size_t i = 0; i < count; ++i) disc.values[i] *= plane.open.values[i];
    const Field thickness = scattering_thickness(pose.mixtures, arm.pixels);
    MeasuringField field(disc, thickness);
    double mean = field.mean(received.values);
    if (!(mean > 0.0)) {
        // The collimator leaves less open than a pixel.
        field = MeasuringField(plane.measured, thickness);
        mean = field.mean(received.values);
    }
    result.weights = field.weights();
    const double quanta = quanta_per_dose_and_area * pixel_width(arm) * pixel_width(arm);
    result.gain = mean > 0.0 ? quanta / mean : 0.0;
    return result;
}

BeamImages enlarged(const BeamImages& from, int factor, const PlaneImages& plane, Field scatter) {
    const int pixels = plane.arm.pixels, few = pixels / factor;
    BeamImages result;
    result.bins = from.bins;
    result.kvp = from.kvp;
    result.gain = from.gain / (factor * factor);
    result.weights = enlarge(from.weights, factor, pixels, pixels);
    result.scatter = std::move(scatter);
    for (std::size_t i = 0; i < result.scatter.values.size(); ++i)
        result.scatter.values[i] *= plane.flat.values[i];
    result.primary.resize(static_cast<std::size_t>(pixels) * pixels);
    // Which two of the few pixels a pixel lies between, and how far from the first.
    struct Place {
        int first, second;
        float fraction;
    };
    std::vector<Place> places;
    for (int i = 0; i < pixels; ++i) {
        const float at = (static_cast<float>(i) + 0.5f) / static_cast<float>(factor) - 0.5f;
        const int below = static_cast<int>(std::floor(at));
        places.push_back({std::max(below, 0), std::min(below + 1, few - 1), at - static_cast<float>(below)});
    }
    const auto between = [](const PixelBins& a, const PixelBins& b, float fraction) {
        PixelBins mixed;
        for (int k = 0; k < energy_bins; ++k) mixed[k] = a[k] + fraction * (b[k] - a[k]);
        return mixed;
    };
    std::vector<PixelBins> row(static_cast<std::size_t>(few));
    for (int j = 0; j < pixels; ++j) {
        const Place& down = places[static_cast<std::size_t>(j)];
        const PixelBins* const above = &from.primary[static_cast<std::size_t>(down.first) * few];
        const PixelBins* const under = &from.primary[static_cast<std::size_t>(down.second) * few];
        for (int i = 0; i < few; ++i)
            row[static_cast<std::size_t>(i)] = between(above[i], under[i], down.fraction);
        PixelBins* const to = &result.primary[static_cast<std::size_t>(j) * pixels];
        for (int i = 0; i < pixels; ++i) {
            const Place& across = places[static_cast<std::size_t>(i)];
            to[i] = between(row[static_cast<std::size_t>(across.first)],
                            row[static_cast<std::size_t>(across.second)], across.fraction);
        }
    }
    return result;
}

}  // namespace render
