#include "render/xray/beam_images.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

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
            measuring_disc(arm, config.measuring_radius * arm.detector_width), filter_thickness(arm)};
}

Field filter_thickness(const CArm& arm) {
    if (!arm.wedge.is_in() && !arm.lung_shutter.is_in()) return {};
    constexpr double thickest = 1.0, ramp = 60.0;  // ramp and circle at the detector [mm]
    constexpr double circle = 100.0;
    Field copper(arm.pixels, arm.pixels);
    const double width = pixel_width(arm);
    for (int j = 0; j < arm.pixels; ++j) {
        for (int i = 0; i < arm.pixels; ++i) {
            const Eigen::Vector2d place((i + 0.5 - 0.5 * arm.pixels) * width,
                                        (0.5 * arm.pixels - j - 0.5) * width);
            const auto toward = [](const BeamFilter& f) {
                return Eigen::Vector2d(std::cos(f.angle), std::sin(f.angle));
            };
            const auto add = [&](double behind_edge) {
                copper.values[static_cast<std::size_t>(j) * arm.pixels + i] +=
                    static_cast<float>(thickest * std::clamp(behind_edge / ramp, 0.0, 1.0));
            };
            if (const BeamFilter& f = arm.wedge; f.is_in()) add(place.dot(toward(f)) - f.edge);
            if (const BeamFilter& f = arm.lung_shutter; f.is_in()) {
                // Outside the circle, and on its covered side alone.
                const Eigen::Vector2d from_middle = place - (f.edge - circle) * toward(f);
                add(std::min(from_middle.norm() - circle, from_middle.dot(toward(f))));
            }
        }
    }
    return copper;
}

PixelBins filter_transmission(float thickness, const Bins& copper) {
    PixelBins passes;
    for (int k = 0; k < energy_bins; ++k) passes[k] = fast_exp(-static_cast<float>(copper[k]) * thickness);
    return passes;
}

PoseImages pose_images(PathLengthRenderer& renderer, std::span<const TissueLayer> layers, bool has_nodes,
                       const CArm& arm) {
    PoseImages pose;
    pose.arm = arm;
    const Field nothing(arm.pixels, arm.pixels);
    const auto mixture = [&](const TissueLayer& tissue) -> Mixture& {
        for (Mixture& m : pose.mixtures)
            if (m.material == tissue.material && m.inside == tissue.inside) return m;
        return pose.mixtures.emplace_back(Mixture{tissue.material, tissue.inside, nothing, nothing});
    };
    const auto add = [](const Field& length, Field& sum) {
        for (std::size_t i = 0; i < length.values.size(); ++i) sum.values[i] += length.values[i];
    };
    // Layers of which only the sum counts are drawn together, those of a mixture at a time.
    std::vector<std::vector<int>> together;
    Field contrast;
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        const TissueLayer& tissue = layers[layer];
        const bool mixed = tissue.material != tissue.inside;
        if (!mixed && !tissue.perfused && has_nodes) continue;
        const int mesh = static_cast<int>(layer);
        Mixture* const sum = mixed ? &mixture(tissue) : nullptr;
        together.resize(pose.mixtures.size());
        if (sum && !tissue.takes_contrast && !tissue.perfused) {
            together[static_cast<std::size_t>(sum - pose.mixtures.data())].push_back(mesh);
            add_lengths(tissue.texture_blobs, arm, sum->length, &sum->before);
            continue;
        }
        Field length = nothing, before = nothing;
        renderer.accumulate({&mesh, 1}, arm, length, {}, &before);
        add_lengths(tissue.texture_blobs, arm, length, &before);
        if (sum) {
            add(length, sum->length);
            add(before, sum->before);
        }
        if (tissue.perfused) pose.organs[mesh] = SparseLength(length);
        if (!tissue.takes_contrast) continue;
        if (contrast.values.empty()) contrast = nothing;
        add(length, contrast);
    }
    for (std::size_t m = 0; m < together.size(); ++m)
        renderer.accumulate(together[m], arm, pose.mixtures[m].length, {}, &pose.mixtures[m].before);
    pose.contrast = SparseLength(contrast);
    return pose;
}

void add_length(std::vector<Mixture>& mixtures, Material material, Material inside, const Field& length) {
    if (material == inside) return;
    for (Mixture& m : mixtures) {
        if (m.material != material || m.inside != inside) continue;
        for (std::size_t i = 0; i < length.values.size(); ++i) m.length.values[i] += length.values[i];
        for (std::size_t i = 0; i < m.before.values.size(); ++i)
            m.before.values[i] += 0.5f * length.values[i];
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

/// Variance of the focal spot's shadow, before and behind the isocentre [pixels²].
struct FocalVariance {
    float before, behind;
};
FocalVariance focal_variance(const CArm& arm, double focal_spot) {
    constexpr double away = 90.0;  // [mm]
    const auto at = [&](double depth) { return focal_blur(arm, focal_spot, std::max(depth, 1.0))(0, 0); };
    // Their mean is that at the isocentre. The kernel has 3 by 3 pixels and must not become negative.
    const double middle = at(arm.sod), apart = 0.5 * (at(arm.sod - away) - at(arm.sod + away));
    const auto possible = [](double variance) { return static_cast<float>(std::clamp(variance, 0.0, 0.5)); };
    return {possible(middle + apart), possible(middle - apart)};
}

/// The exponents of a row of pixels, bins side by side.
struct ExponentRow {
    std::vector<float> sum, blurred;  // Σ −μ·length; the same with each part times its variance

    explicit ExponentRow(std::size_t pixels) : sum(pixels * energy_bins), blurred(sum.size()) {}
    void make(int row, std::span<const Mixture> mixtures, std::span<const PixelBins> changes,
              const FocalVariance& variance) {
        std::fill(sum.begin(), sum.end(), 0.0f);
        std::fill(blurred.begin(), blurred.end(), 0.0f);
        const std::size_t pixels = sum.size() / energy_bins, start = static_cast<std::size_t>(row) * pixels;
        const float mean = 0.5f * (variance.before + variance.behind);
        for (std::size_t m = 0; m < mixtures.size(); ++m) {
            const float* const length = mixtures[m].length.values.data() + start;
            const float* const before =
                mixtures[m].before.values.empty() ? nullptr : mixtures[m].before.values.data() + start;
            for (std::size_t i = 0; i < pixels; ++i) {
                const float weighed =
                    before ? variance.behind * length[i] + (variance.before - variance.behind) * before[i]
                           : mean * length[i];
                for (int k = 0; k < energy_bins; ++k) {
                    sum[i * energy_bins + k] -= changes[m][k] * length[i];
                    blurred[i * energy_bins + k] -= changes[m][k] * weighed;
                }
            }
        }
    }
};

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
    // The row, that above and that below it stay in the cache.
    const std::size_t row = static_cast<std::size_t>(arm.pixels);
    const FocalVariance variance = focal_variance(arm, focal_spot);
    const Bins copper = result.bins.attenuation(Material::Copper);
    ExponentRow above(row), here(row), below(row);
    here.make(0, pose.mixtures, changes, variance);
    for (std::size_t start = 0; start < count; start += row) {
        const int j = static_cast<int>(start / row);
        if (j + 1 < arm.pixels) below.make(j + 1, pose.mixtures, changes, variance);
        std::vector<float>& exponents = here.sum;
        // Neighbours beyond the border are as what lies there.
        const float* const up = j > 0 ? above.blurred.data() : here.blurred.data();
        const float* const down = j + 1 < arm.pixels ? below.blurred.data() : here.blurred.data();
        const float* const own = here.blurred.data();
        const std::size_t values = exponents.size();
        for (std::size_t e = 0; e < values; ++e) exponents[e] += 0.5f * (up[e] + down[e] - 2.0f * own[e]);
        for (std::size_t e = energy_bins; e + energy_bins < values; ++e)
            exponents[e] += 0.5f * (own[e - energy_bins] + own[e + energy_bins] - 2.0f * own[e]);
        exponentiate(exponents);
        for (std::size_t i = 0; i < row; ++i) {
            const std::size_t pixel = start + i;
            for (int k = 0; k < energy_bins; ++k) {
                result.primary[pixel][k] = plane.flat.values[pixel] *
                                           static_cast<float>(result.bins.weights[k]) *
                                           exponents[i * energy_bins + k];
            }
            if (!plane.copper.values.empty() && plane.copper.values[pixel] > 0.0f) {
                const PixelBins passes = filter_transmission(plane.copper.values[pixel], copper);
                for (int k = 0; k < energy_bins; ++k) result.primary[pixel][k] *= passes[k];
            }
            result.scatter.values[pixel] *= plane.flat.values[pixel];
            received.values[pixel] = sum(result.primary[pixel]) + result.scatter.values[pixel];
        }
        std::swap(above, here);
        std::swap(here, below);
    }

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
