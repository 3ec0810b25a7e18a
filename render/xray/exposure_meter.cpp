#include "render/xray/exposure_meter.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "render/picture/fast_exp.h"
#include "render/picture/filter.h"
#include "render/xray/measuring_field.h"
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
                             std::vector<VolumeCaster> volumes, std::shared_ptr<const MeteredLayers> known)
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
    for (const VolumeCaster& volume : volumes_) {
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

}  // namespace render
