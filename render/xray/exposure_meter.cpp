#include "render/xray/exposure_meter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "physics/geometry/parallel.h"
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

int processors() {
    return static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
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
    for (std::size_t number = 0; number < layers.size(); ++number) {
        const TissueLayer& layer = layers[number];
        if (layer.material != layer.inside)
            layers_.push_back(
                {layer.material, layer.inside, meshes_.add(layer.mesh), static_cast<int>(number)});
    }
}

ExposureMeter::ExposureMeter(const FluoroscopeConfig& config, std::span<const TissueLayer> layers,
                             std::vector<VolumeRayCaster> volumes, std::shared_ptr<const MeteredLayers> known)
    : config_(config), volumes_(std::move(volumes)) {
    if (known) layers_.push_back(std::move(known));
    layers_.push_back(std::make_shared<MeteredLayers>(layers));
}

ExposureMeter::ExposureMeter(const FluoroscopeConfig& config, const CArm& arm, std::vector<Mixture> lengths)
    : config_(config), pose_(posed(arm, std::move(lengths))) {}

const std::vector<Mixture>& ExposureMeter::lengths_at(const CArm& arm) {
    move_to(arm);
    return pose_->mixtures;
}

void ExposureMeter::move_to(const CArm& arm) {
    if (pose_ && pose_->arm == arm) return;
    pose_ = posed(arm, lengths(around_the_opening(arm, places), {}, {}));
}

ExposureMeter::Pose ExposureMeter::posed(const CArm& arm, std::vector<Mixture> lengths) const {
    Pose pose;
    pose.arm = arm;
    pose.coarse = around_the_opening(arm, places);
    pose.mixtures = std::move(lengths);
    pose.thickness = scattering_thickness(pose.mixtures, places);
    pose.open = shutters(config_.display, pose.coarse);
    pose.copper = filter_thickness(pose.coarse);
    pose.measured = measuring_disc(pose.coarse, config_.measuring_radius * arm.detector_width);
    for (std::size_t i = 0; i < pose.measured.values.size(); ++i)
        pose.measured.values[i] *= pose.open.values[i];
    return pose;
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
    double open = 0.0, open_filtered = 0.0;
    const Bins copper = bins.attenuation(Material::Copper);
    for (std::size_t i = 0; i < lit.values.size(); ++i) {
        if (!pose_->copper.values.empty()) {
            const PixelBins passes = filter_transmission(pose_->copper.values[i], copper);
            double unfiltered_kerma = 0.0, filtered_kerma = 0.0;
            for (int k = 0; k < energy_bins; ++k) {
                const auto kerma_here =
                    static_cast<float>(bins.weights[k] * kerma_per_signal(bins.energies[k]));
                signal_weight[k] = static_cast<float>(bins.weights[k]) * passes[k];
                kerma_weight[k] = kerma_here * passes[k];
                unfiltered_kerma += kerma_here;
                filtered_kerma += kerma_weight[k];
            }
            open += pose_->open.values[i] * unfiltered_kerma;
            open_filtered += pose_->open.values[i] * filtered_kerma;
            if (i == lit.values.size() / 2 + places / 2)
                result.filtered_middle = filtered_kerma / unfiltered_kerma;
        }
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
    if (open > 0.0) result.filtered = open_filtered / open;
    result.scatter = scatter_field(lit, pose_->thickness, kvp, pixel_width(pose_->coarse),
                                   pose_->arm.sid - pose_->arm.sod);
    for (float& value : result.scatter.values) value *= static_cast<float>(config_.scatter);

    // Scatter is taken to have the spectrum of what passes on average.
    const MeasuringField field(pose_->measured, pose_->thickness);
    const double passed = field.mean(signal), kerma_passed = field.mean(kerma);
    const auto kerma_of_scatter = static_cast<float>(passed > 0.0 ? kerma_passed / passed : 0.0);
    for (std::size_t i = 0; i < kerma.size(); ++i) {
        kerma[i] += kerma_of_scatter * result.scatter.values[i];
        signal[i] += result.scatter.values[i];
    }
    result.measured = field.mean(signal);
    // Never zero: through metres of bone the tube reaches its limit long before.
    const double transmitted = std::max(field.mean(kerma), 1e-20);
    const double metres = 1e-3 * pose_->arm.sid;
    constexpr double nGy_per_mGy = 1e6;
    result.charge_per_dose =
        open_kerma(spectrum) / transmitted * metres * metres / (kerma_per_charge(kvp) * nGy_per_mGy);
    return result;
}

std::vector<Mixture> ExposureMeter::lengths(const CArm& arm, std::span<const TissueLayer> layers,
                                            const MoverFractions& fractions) const {
    struct Drawn {
        const MeteredLayers* of;
        MeteredLayers::Layer layer;
        const TissueLayer* tissue;  // null: at rest and without texture
        Field length;
    };
    std::vector<Drawn> drawn;
    std::size_t before = 0;
    for (const auto& some : layers_) {
        for (const MeteredLayers::Layer& layer : some->layers_) {
            const std::size_t number = before + static_cast<std::size_t>(layer.number);
            drawn.push_back({some.get(), layer, layers.empty() ? nullptr : &layers[number], {}});
        }
        before += some->count();
    }
    geometry::for_each_index(static_cast<int>(drawn.size()), processors(), [&](int i) {
        Drawn& one = drawn[static_cast<std::size_t>(i)];
        one.length = Field(arm.pixels, arm.pixels);
        CoarseLengths::Moves moves;
        if (one.tissue) moves = {{one.tissue->breath, one.tissue->beat, one.tissue->drift}, fractions};
        one.of->meshes_.accumulate(one.layer.mesh, arm, one.length, moves);
        if (one.tissue) add_lengths(one.tissue->texture_blobs, arm, one.length);
    });
    std::vector<Mixture> mixtures;
    for (const Drawn& one : drawn) add_length(mixtures, one.layer.material, one.layer.inside, one.length);
    for (const VolumeRayCaster& volume : volumes_) {
        const std::vector<Field> through = volume.every_length(arm);
        for (std::size_t p = 0; p < through.size(); ++p)
            add_length(mixtures, volume.parts()[p].material, volume.parts()[p].inside, through[p]);
    }
    return mixtures;
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

double ExposureMeter::measured(const CArm& arm, double kvp) {
    move_to(arm);
    return beam(kvp).measured;
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
    result.air_kerma = beam(kvp).filtered_middle * at_one_metre / (metres * metres);
    result.area_product =
        beam(kvp).filtered * at_one_metre * open_area(arm) / (1e-6 * arm.sid * arm.sid) * Gy_cm2_per_mGy_mm2;
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

/// The pixels whose centres may lie under a corner, from left and top to right and bottom, the latter two
/// negative: the least of three corners' bounds are those of their triangle.
using Bounds = std::int32_t __attribute__((vector_size(16)));

/// A corner as the camera sees it: right, up, depth from the source [mm].
struct Corner {
    Vec3 place;
    Bounds bounds;
};

/// The side of the plane through the source and an edge from a to b, at rays (x, y, 1).
struct EdgePlane {
    Vec3 normal;
    bool ascends;

    EdgePlane(const Vec3& a, const Vec3& b)
        : normal(a.cross(b)),
          ascends(std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3)) {}
    double of_row(double y) const { return normal.y() * y + normal.z(); }
    /// Which side the ray points to. Two triangles that share the edge get opposite answers, also for a ray
    /// through the edge itself, so that no ray slips between them.
    bool has_left(double x, double row) const {
        const double side = normal.x() * x + row;
        return side != 0.0 ? side > 0.0 : ascends;
    }
};

}  // namespace

void CoarseLengths::accumulate(int mesh, const CArm& arm, Field& sum, const Moves& moves) const {
    const int pixels = arm.pixels;
    assert(sum.width == pixels && sum.height == pixels);
    const Mesh& drawn = meshes_.at(static_cast<std::size_t>(mesh));
    const ArmAxes a = axes(arm);
    const double step = pixel_width(arm) / arm.sid, middle = 0.5 * pixels;
    constexpr double nearest = 1.0;  // depth at which a corner still has a place in the image [mm]
    // Pixel centres stand at halves. The slack covers rounding; which of them a triangle covers is decided
    // below.
    constexpr double slack = 1e-6;
    const auto first = [&](double low) {
        const double from = low - 0.5 - slack;
        if (!(from > 0.0)) return 0;
        if (from >= pixels) return pixels;
        const int below = static_cast<int>(from);
        return below + (from > below);
    };
    const auto last = [&](double high) {
        const double to = high - 0.5 + slack;
        if (!(to >= 0.0)) return -1;
        return to >= pixels - 1.0 ? pixels - 1 : static_cast<int>(to);
    };
    std::vector<Corner> corners;
    corners.reserve(drawn.vertices.size());
    for (std::size_t i = 0; i < drawn.vertices.size(); ++i) {
        const auto& v = drawn.vertices[i];
        Vec3 from = Vec3(v[0], v[1], v[2]) - arm.isocentre;
        for (int m = 0; m < movers; ++m)
            if (moves.fractions[m] > 0.0 && !moves.of[m].empty())
                from += moves.fractions[m] * moves.of[m][i].cast<double>();
        const Vec3 place(a.right.dot(from), a.up.dot(from), arm.sod + a.beam.dot(from));
        // A triangle that reaches toward the source may cover any pixel.
        Bounds bounds = {0, 0, 1 - pixels, 1 - pixels};
        if (place.z() > nearest) {
            const double scale = 1.0 / (step * place.z()), x = middle + scale * place.x(),
                         y = middle - scale * place.y();
            bounds = Bounds{first(x), first(y), -last(x), -last(y)};
        }
        corners.push_back({place, bounds});
    }

    std::vector<double> depths(sum.values.size(), 0.0);
    std::vector<int> balance(sum.values.size(), 0);
    const auto least = [](const Bounds& one, const Bounds& other) { return one < other ? one : other; };
    for (const auto& triangle : drawn.triangles) {
        const Corner &p = corners[triangle[0]], &q = corners[triangle[1]], &r = corners[triangle[2]];
        const Bounds bounds = least(least(p.bounds, q.bounds), r.bounds);
        const int left = bounds[0], top = bounds[1], right = -bounds[2], bottom = -bounds[3];
        if (left > right || top > bottom) continue;
        const Vec3 normal = (q.place - p.place).cross(r.place - p.place);
        const double level = normal.dot(p.place);
        const EdgePlane pq(p.place, q.place), qr(q.place, r.place), rp(r.place, p.place);
        for (int j = top; j <= bottom; ++j) {
            const double y = (middle - j - 0.5) * step;
            const double pq_row = pq.of_row(y), qr_row = qr.of_row(y), rp_row = rp.of_row(y),
                         normal_row = normal.y() * y + normal.z();
            for (int i = left; i <= right; ++i) {
                const double x = (i + 0.5 - middle) * step;
                const bool one = pq.has_left(x, pq_row);
                if (one != qr.has_left(x, qr_row) || one != rp.has_left(x, rp_row)) continue;
                const double slope = normal.x() * x + normal_row;
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
