#include "render/xray/exposure_meter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "render/picture/fast_math.h"
#include "render/picture/filter.h"
#include "render/xray/scatter.h"

namespace render {

void require_usable(const CArm& arm, const Exposure& exposure) {
    std::string wrong;
    for (const auto& found : {problems(arm), problems(exposure)})
        for (const std::string& sentence : found) wrong += (wrong.empty() ? "" : "; ") + sentence;
    if (!wrong.empty()) throw std::invalid_argument(wrong);
}

namespace {

constexpr double usual_dose = 30.0;  // of a fluoroscopy pulse [nGy]

/// Air kerma of the open beam per detected signal, in the units of kerma_per_signal.
double open_kerma(const Spectrum& spectrum) {
    double sum = 0.0;
    for (std::size_t i = 0; i < spectrum.energies.size(); ++i)
        sum += spectrum.weights[i] * kerma_per_signal(spectrum.energies[i]);
    return sum;
}

/// The open part of the field, with room for the shutters' soft edge.
CArm around_the_opening(CArm arm, int places) {
    constexpr double margin = 1.1;
    arm.detector_width =
        std::min(arm.detector_width, margin * std::max(arm.opening_width, arm.opening_height));
    arm.pixels = places;
    return arm;
}

}  // namespace

MeteredLayers::MeteredLayers(std::span<const TissueLayer> layers) : count_(layers.size()) {
    for (const TissueLayer& layer : layers)
        if (layer.material != layer.inside)
            layers_.push_back({layer.material, layer.inside, meshes_.add(layer.mesh)});
}

ExposureMeter::ExposureMeter(const FluoroscopeConfig& config, std::span<const TissueLayer> layers,
                             std::vector<VolumeRayCaster> volumes, std::shared_ptr<const MeteredLayers> known)
    : config_(config), volumes_(std::move(volumes)) {
    if (known) layers_.push_back(std::move(known));
    layers_.push_back(std::make_shared<MeteredLayers>(layers));
}

void ExposureMeter::move_to(const CArm& arm) {
    if (pose_ && pose_->arm == arm) return;
    Pose& pose = pose_.emplace();
    pose.arm = arm;
    pose.coarse = around_the_opening(arm, places);
    const Field nothing(places, places);
    for (const auto& some : layers_) {
        for (const MeteredLayers::Layer& layer : some->layers_) {
            auto mixture = std::find_if(pose.mixtures.begin(), pose.mixtures.end(), [&](const Mixture& m) {
                return m.material == layer.material && m.inside == layer.inside;
            });
            if (mixture == pose.mixtures.end())
                mixture = pose.mixtures.insert(mixture, {layer.material, layer.inside, nothing});
            some->meshes_.accumulate(layer.mesh, pose.coarse, mixture->length);
        }
    }
    for (const VolumeRayCaster& volume : volumes_) {
        const std::vector<Field> lengths = volume.every_length(pose.coarse);
        for (std::size_t p = 0; p < lengths.size(); ++p)
            add_length(pose.mixtures, volume.parts()[p].material, volume.parts()[p].inside, lengths[p]);
    }
    pose.thickness = scattering_thickness(pose.mixtures, places);
    pose.open = shutters(config_.display, pose.coarse);
    pose.measured = measuring_disc(pose.coarse, config_.measuring_radius * arm.detector_width);
    for (std::size_t i = 0; i < pose.measured.values.size(); ++i)
        pose.measured.values[i] *= pose.open.values[i];
}

const ExposureMeter::Beam& ExposureMeter::beam(double kvp) {
    const auto [at, is_new] = pose_->beams.try_emplace(kvp);
    Beam& result = at->second;
    if (!is_new) return result;

    const Spectrum spectrum = detected_spectrum(kvp);
    const EnergyBins bins = fit_bins(spectrum);
    std::vector<PixelBins> changes;
    for (const Mixture& m : pose_->mixtures) changes.push_back(change_of(m, bins));
    PixelBins signal_weight, kerma_weight;
    for (int k = 0; k < energy_bins; ++k) {
        signal_weight[k] = static_cast<float>(bins.weights[k]);
        kerma_weight[k] = static_cast<float>(bins.weights[k] * kerma_per_signal(bins.energies[k]));
    }
    Field lit(places, places);
    std::vector<float> signal(lit.values.size()), kerma(lit.values.size());
    for (std::size_t i = 0; i < lit.values.size(); ++i) {
        for (int k = 0; k < energy_bins; ++k) {
            float exponent = 0.0f;
            for (std::size_t m = 0; m < changes.size(); ++m)
                exponent -= changes[m][k] * pose_->mixtures[m].length.values[i];
            const float transmitted = fast_exp(exponent);
            signal[i] += signal_weight[k] * transmitted;
            kerma[i] += kerma_weight[k] * transmitted;
        }
        lit.values[i] = pose_->open.values[i] * signal[i];
    }
    result.scatter = scatter_field(lit, pose_->thickness, kvp, pixel_width(pose_->coarse),
                                   pose_->arm.sid - pose_->arm.sod);
    for (float& value : result.scatter.values) value *= static_cast<float>(config_.scatter);

    // Scatter is taken to have the spectrum of what passes on average.
    const MeasuringField field(pose_->measured, pose_->thickness);
    const double passed = field.mean(signal), kerma_passed = field.mean(kerma);
    const auto kerma_of_scatter = static_cast<float>(passed > 0.0 ? kerma_passed / passed : 0.0);
    for (std::size_t i = 0; i < kerma.size(); ++i) kerma[i] += kerma_of_scatter * result.scatter.values[i];
    // Never zero: through metres of bone the tube reaches its limit long before.
    const double transmitted = std::max(field.mean(kerma), 1e-20);
    const double metres = 1e-3 * pose_->arm.sid;
    constexpr double nGy_per_mGy = 1e6;
    result.charge_per_dose =
        open_kerma(spectrum) / transmitted * metres * metres / (kerma_per_charge(kvp) * nGy_per_mGy);
    return result;
}

double ExposureMeter::voltage(const CArm& arm, const std::optional<double>& kvp) {
    if (kvp) return *kvp;
    move_to(arm);
    // The voltage belongs to the usual dose, so that a change of dose does not change the contrast.
    if (!pose_->automatic)
        pose_->automatic =
            automatic_exposure([&](double kv) { return usual_dose * beam(kv).charge_per_dose; }).kvp;
    return *pose_->automatic;
}

Field ExposureMeter::scatter(const CArm& arm, double kvp) {
    move_to(arm);
    return stretched(beam(kvp).scatter, pixel_width(arm) / pixel_width(pose_->coarse), arm.pixels);
}

Technique ExposureMeter::technique(const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    move_to(arm);
    const double kvp = voltage(arm, exposure.kvp);
    Technique result = exposure_at(kvp, exposure.detector_dose * beam(kvp).charge_per_dose);
    const double metres = 1e-3 * std::max(arm.sod - reference_point, 1.0);
    const double charge = 1e-3 * result.current * result.pulse_width;  // [mAs]
    const double at_one_metre = kerma_per_charge(kvp) * charge;        // [mGy]
    constexpr double Gy_cm2_per_mGy_mm2 = 1e-5;
    result.air_kerma = at_one_metre / (metres * metres);
    result.area_product = at_one_metre * open_area(arm) / (1e-6 * arm.sid * arm.sid) * Gy_cm2_per_mGy_mm2;
    return result;
}

namespace {

/// 0 below 0, 1 above 1, smooth between.
template <class Number>
Number smooth_step(Number t) {
    const Number within = std::clamp(t, Number(0), Number(1));
    return within * within * (Number(3) - Number(2) * within);
}

}  // namespace

MeasuringField::MeasuringField(const Field& disc, const Field& thickness) : disc_(disc), patient_(disc) {
    assert(disc.values.size() == thickness.values.size());
    double length = 0.0, square = 0.0, covered = 0.0;
    for (std::size_t i = 0; i < disc.values.size(); ++i) {
        const float t = thickness.values[i];
        patient_.values[i] *= smooth_step((t - nothing) / (body - nothing));
        const double weighed = static_cast<double>(patient_.values[i]) * std::max(t, 0.0f);
        disc_sum_ += disc_.values[i];
        covered += patient_.values[i];
        length += weighed;
        square += weighed * t;
    }
    if (!(length > 0.0 && disc_sum_ > 0.0)) return;
    const auto mean = static_cast<float>(square / length);
    for (std::size_t i = 0; i < disc.values.size(); ++i) {
        patient_.values[i] *= smooth_step((thickness.values[i] / mean - thin) / (thick - thin));
        patient_sum_ += patient_.values[i];
    }
    patient_alone_ = smooth_step(covered / disc_sum_ / enough);
}

namespace {

/// Geometric mean of the values between two quantiles. It follows the values and their weights without jumps,
/// as a quantile alone would not where values form two groups.
double mean_between(std::span<const float> values, std::span<const float> weights, double from, double to) {
    // A histogram of logarithms; each value shares its weight between two of its steps.
    constexpr float lowest = -60.0f, per_step = 1.0f / 32;
    constexpr std::size_t steps = 64 * 32;
    std::vector<double> counted(steps + 1, 0.0);
    double all = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (!(weights[i] > 0.0f)) continue;
        const float place = std::clamp((std::log(std::max(values[i], 1e-30f)) - lowest) / per_step, 0.0f,
                                       static_cast<float>(steps) - 0.001f);
        const auto step = static_cast<std::size_t>(place);
        const double above = static_cast<double>(weights[i]) * (place - static_cast<float>(step));
        counted[step] += weights[i] - above;
        counted[step + 1] += above;
        all += weights[i];
    }
    double passed = 0.0, sum = 0.0;
    for (std::size_t step = 0; step <= steps; ++step) {
        const double first = std::max(passed, from * all);
        passed += counted[step];
        const double end = std::min(passed, to * all);
        if (end > first) sum += (end - first) * (lowest + per_step * static_cast<float>(step));
    }
    return std::exp(sum / ((to - from) * all));
}

}  // namespace

double MeasuringField::mean(std::span<const float> signal) const {
    assert(signal.size() == disc_.values.size());
    if (!(disc_sum_ > 0.0)) return 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < signal.size(); ++i) all += static_cast<double>(disc_.values[i]) * signal[i];
    all /= disc_sum_;
    if (!(all > 0.0) || !(patient_sum_ > 0.0)) return all;
    const auto most = static_cast<float>(brightest * mean_between(signal, patient_.values, darkest, dark));
    double patient = 0.0;
    for (std::size_t i = 0; i < signal.size(); ++i)
        patient += static_cast<double>(patient_.values[i]) * std::min(signal[i], most);
    if (!(patient > 0.0)) return all;
    return all * std::exp(patient_alone_ * std::log(patient / patient_sum_ / all));
}

Field MeasuringField::weights() const {
    Field result = disc_;
    const auto fraction = static_cast<float>(patient_alone_);
    for (std::size_t i = 0; i < result.values.size(); ++i)
        result.values[i] += fraction * (patient_.values[i] - disc_.values[i]);
    return result;
}

int CoarseLengths::add(const geometry::TriangleMesh& mesh) {
    Mesh& kept = meshes_.emplace_back();
    kept.vertices.reserve(mesh.vertices.size());
    for (const Vec3& v : mesh.vertices)
        kept.vertices.push_back(
            {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
    kept.triangles.reserve(mesh.triangles.size());
    const auto count = static_cast<int>(mesh.vertices.size());
    for (const auto& t : mesh.triangles) {
        for (const int v : t)
            if (v < 0 || v >= count)
                throw std::invalid_argument("a triangle names vertex " + std::to_string(v) + " of " +
                                            std::to_string(count));
        kept.triangles.push_back({t[0], t[1], t[2]});
    }
    return static_cast<int>(meshes_.size()) - 1;
}

namespace {

/// A corner as the camera sees it: right, up, depth from the source [mm], and its place in the image.
struct Corner {
    Vec3 place;
    double x, y;  // [pixels]; meaningless unless the corner is before the source
};

/// Which side of the plane through source, a and b the ray points to. Two triangles that share the edge get
/// opposite answers, also for a ray through the edge itself, so that no ray slips between them.
bool is_left(const Vec3& ray, const Vec3& a, const Vec3& b) {
    const double side = ray.dot(a.cross(b));
    if (side != 0.0) return side > 0.0;
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

void CoarseLengths::accumulate(int mesh, const CArm& arm, Field& sum) const {
    const int pixels = arm.pixels;
    assert(sum.width == pixels && sum.height == pixels);
    const Mesh& drawn = meshes_.at(static_cast<std::size_t>(mesh));
    const ArmAxes a = axes(arm);
    const double step = pixel_width(arm) / arm.sid, middle = 0.5 * pixels;
    constexpr double nearest = 1.0;  // depth at which a corner still has a place in the image [mm]
    std::vector<Corner> corners;
    corners.reserve(drawn.vertices.size());
    for (const auto& v : drawn.vertices) {
        const Vec3 from = Vec3(v[0], v[1], v[2]) - arm.isocentre;
        const Vec3 place(a.right.dot(from), a.up.dot(from), arm.sod + a.beam.dot(from));
        const double scale = 1.0 / (step * std::max(place.z(), nearest));
        corners.push_back({place, middle + scale * place.x(), middle - scale * place.y()});
    }

    std::vector<double> depths(sum.values.size(), 0.0);
    std::vector<int> balance(sum.values.size(), 0);
    // Pixel centres stand at halves. The slack covers rounding; which of them a triangle covers is decided
    // below.
    constexpr double slack = 1e-6;
    const auto first = [&](double low) {
        return static_cast<int>(std::clamp(std::ceil(low - 0.5 - slack), 0.0, double(pixels)));
    };
    const auto last = [&](double high) {
        return static_cast<int>(std::clamp(std::floor(high - 0.5 + slack), -1.0, pixels - 1.0));
    };
    for (const auto& triangle : drawn.triangles) {
        const Corner &p = corners[triangle[0]], &q = corners[triangle[1]], &r = corners[triangle[2]];
        int left = 0, right = pixels - 1, top = 0, bottom = pixels - 1;
        if (std::min({p.place.z(), q.place.z(), r.place.z()}) > nearest) {
            left = first(std::min({p.x, q.x, r.x})), right = last(std::max({p.x, q.x, r.x}));
            top = first(std::min({p.y, q.y, r.y})), bottom = last(std::max({p.y, q.y, r.y}));
        }
        if (left > right || top > bottom) continue;
        const Vec3 normal = (q.place - p.place).cross(r.place - p.place);
        const double level = normal.dot(p.place);
        for (int j = top; j <= bottom; ++j) {
            for (int i = left; i <= right; ++i) {
                const Vec3 ray((i + 0.5 - middle) * step, (middle - j - 0.5) * step, 1.0);
                const bool one = is_left(ray, p.place, q.place);
                if (one != is_left(ray, q.place, r.place) || one != is_left(ray, r.place, p.place)) continue;
                const double slope = normal.dot(ray);
                const double depth = slope != 0.0 ? level / slope : p.place.z();
                if (!(depth > 0.0)) continue;
                const std::size_t pixel = static_cast<std::size_t>(j) * pixels + i;
                // Outward normals point along the ray where it leaves.
                depths[pixel] += one ? depth : -depth;
                balance[pixel] += one ? 1 : -1;
            }
        }
    }
    for (int j = 0; j < pixels; ++j) {
        for (int i = 0; i < pixels; ++i) {
            const std::size_t pixel = static_cast<std::size_t>(j) * pixels + i;
            if (balance[pixel] != 0 || !(depths[pixel] > 0.0)) continue;
            const double x = (i + 0.5 - middle) * step, y = (middle - j - 0.5) * step;
            sum.values[pixel] += static_cast<float>(depths[pixel] * std::sqrt(1.0 + x * x + y * y));
        }
    }
}

}  // namespace render
