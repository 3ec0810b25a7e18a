#include "render/fluoroscope.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "render/filter.h"
#include "render/path_length.h"

namespace render {

using physics::Vec3;

namespace {

using PixelBins = std::array<float, energy_bins>;

/// Lengths through all layers that change μ in the same way.
struct Mixture {
    Material material, inside;
    Field length;  // [mm]
};

/// What the pose determines, and the mesh passes cost time for.
struct PoseImages {
    CArm arm;
    Field flat, open, measured;  // open beam, collimator, measuring field: shares of 1
    std::vector<Mixture> mixtures;
    Field contrast_length;                       // through layers that take contrast [mm]
    std::vector<std::uint32_t> contrast_pixels;  // where that is not 0
    std::map<int, Field> organs;                 // length through each perfused layer [mm]
    std::optional<ContrastMatrix> vessels;       // made when contrast first needs it
    int unbalanced_pixels = 0;
};

/// What the tube voltage adds to that.
struct BeamImages {
    EnergyBins bins;
    Technique technique;             // for 1 nGy at the detector, where the tube has no limits
    std::vector<PixelBins> primary;  // per pixel and bin, relative to the open beam, flat field included
    Field scatter;                   // in the same unit
    double gain = 0.0;               // quanta per unit and nGy
};

/// The image with neither contrast nor wire at one dose.
struct BareImage {
    float scale = 0.0f;  // quanta per unit of BeamImages
    Field expected;      // with scatter [quanta]
    Technique technique;
    std::optional<Display> display;
};

/// Intensity with nothing in the beam, as share of its middle: inverse square and obliquity (cos³), heel
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

/// 1 in the disc where automatic exposure measures, 0 outside: air beside the patient does not count.
Field measuring_field(const CArm& arm, double radius) {
    Field field(arm.pixels, arm.pixels);
    // Never without a pixel.
    const double reach = std::max(radius * arm.pixels, 1.0);
    for (int j = 0; j < arm.pixels; ++j) {
        for (int i = 0; i < arm.pixels; ++i) {
            const double away = std::hypot(i + 0.5 - 0.5 * arm.pixels, j + 0.5 - 0.5 * arm.pixels);
            field.values[static_cast<std::size_t>(j) * arm.pixels + i] = away <= reach ? 1.0f : 0.0f;
        }
    }
    return field;
}

/// The arm as what is shifted sees it.
CArm shifted(CArm arm, const Vec3& shift) {
    arm.isocentre -= shift;
    return arm;
}

constexpr double usual_dose = 30.0;  // of a fluoroscopy pulse [nGy]

/// Air kerma of the open beam per detected signal, in units of kerma_per_signal.
double open_kerma(double kvp) {
    const Spectrum spectrum = detected_spectrum(kvp);
    double sum = 0.0;
    for (std::size_t i = 0; i < spectrum.energies.size(); ++i)
        sum += spectrum.weights[i] * kerma_per_signal(spectrum.energies[i]);
    return sum;
}

float sum(const PixelBins& bins) {
    float result = 0.0f;
    for (float value : bins) result += value;
    return result;
}

}  // namespace

std::vector<std::string> problems(const Exposure& exposure) {
    std::vector<std::string> found;
    if (!(exposure.detector_dose > 0.0 && exposure.detector_dose <= 1e5)) {
        found.emplace_back("the detector dose must be above 0 and at most 100000 nGy");
    }
    if (exposure.kvp && !(*exposure.kvp >= 40.0 && *exposure.kvp <= 125.0)) {
        found.emplace_back("the tube voltage must lie within 40 and 125 kV");
    }
    if (!(exposure.iodine >= 0.0 && exposure.iodine <= 400.0)) {
        found.emplace_back("the iodine concentration must lie within 0 and 400 mg/ml");
    }
    return found;
}

struct Fluoroscope::State {
    FluoroscopeConfig config;
    std::vector<TissueLayer> layers;  // their meshes have moved on to the renderer
    PathLengthRenderer renderer;
    std::optional<LumenContrast> vessels;
    WireImage wire;
    std::optional<PoseImages> pose;
    std::map<double, BeamImages> beams;                   // of the pose, by voltage asked for; 0 = automatic
    std::map<std::pair<double, double>, BareImage> bare;  // of the pose, by voltage and dose
    Field iodine;                                         // scratch: what the beam meets of it [mg/ml·mm]
    std::vector<std::uint32_t> iodine_pixels;

    void move_to(const CArm&);
    double charge(double kvp) const;
    const BeamImages& beam(const std::optional<double>& kvp);
    const BareImage& bare_image(const Exposure&);
    void dissolve(const Exposure&);
    void dissolve_in_vessels(const Exposure&);
};

void Fluoroscope::State::move_to(const CArm& arm) {
    if (pose && pose->arm == arm) return;
    beams.clear();
    bare.clear();
    pose.emplace();
    pose->arm = arm;
    pose->flat = flat_field(arm, config.heel);
    pose->open = shutters(config.display, arm);
    pose->measured = measuring_field(arm, config.measuring_radius);
    pose->contrast_length = Field(arm.pixels, arm.pixels);
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        const TissueLayer& tissue = layers[layer];
        const bool seen = tissue.material != tissue.inside || tissue.perfused;
        if (!seen && vessels) continue;
        PathLengthRenderer::Result path = renderer.render(static_cast<int>(layer), arm);
        pose->unbalanced_pixels += path.unbalanced_pixels;
        const std::size_t count = path.length.values.size();
        if (tissue.takes_contrast) {
            for (std::size_t i = 0; i < count; ++i) pose->contrast_length.values[i] += path.length.values[i];
        }
        if (tissue.material != tissue.inside) {
            const auto same = [&](const Mixture& m) {
                return m.material == tissue.material && m.inside == tissue.inside;
            };
            const auto known = std::find_if(pose->mixtures.begin(), pose->mixtures.end(), same);
            if (known == pose->mixtures.end()) {
                pose->mixtures.push_back({tissue.material, tissue.inside, path.length});
            } else {
                for (std::size_t i = 0; i < count; ++i) known->length.values[i] += path.length.values[i];
            }
        }
        if (tissue.perfused) pose->organs[static_cast<int>(layer)] = std::move(path.length);
    }
    for (std::size_t i = 0; i < pose->contrast_length.values.size(); ++i) {
        if (pose->contrast_length.values[i] > 0.0f)
            pose->contrast_pixels.push_back(static_cast<std::uint32_t>(i));
    }
}

/// Of a pulse at that voltage that gives the detector 1 nGy [mAs], from a sample of the measuring field.
double Fluoroscope::State::charge(double kvp) const {
    const CArm& arm = pose->arm;
    const EnergyBins bins = fit_bins(detected_spectrum(kvp));
    std::vector<PixelBins> change;
    for (const Mixture& m : pose->mixtures) {
        const Bins own = bins.attenuation(m.material), around = bins.attenuation(m.inside);
        PixelBins difference;
        for (int k = 0; k < energy_bins; ++k) difference[k] = static_cast<float>(own[k] - around[k]);
        change.push_back(difference);
    }
    constexpr int sampled = 24;  // places along either side
    double kerma = 0.0;
    int places = 0;
    const int step = std::max(1, arm.pixels / sampled);
    for (int j = step / 2; j < arm.pixels; j += step) {
        for (int i = step / 2; i < arm.pixels; i += step) {
            const std::size_t pixel = static_cast<std::size_t>(j) * arm.pixels + i;
            if (pose->measured.values[pixel] == 0.0f) continue;
            ++places;
            for (int k = 0; k < energy_bins; ++k) {
                double exponent = 0.0;
                for (std::size_t m = 0; m < change.size(); ++m)
                    exponent -= change[m][k] * pose->mixtures[m].length.values[pixel];
                kerma += bins.weights[k] * kerma_per_signal(bins.energies[k]) * std::exp(exponent);
            }
        }
    }
    const double transmitted = (1.0 + config.scatter_to_primary) * kerma / std::max(places, 1);
    const double metres = 1e-3 * arm.sid;
    constexpr double nGy_per_mGy = 1e6;
    return open_kerma(kvp) / transmitted * metres * metres / (kerma_per_charge(kvp) * nGy_per_mGy);
}

const BeamImages& Fluoroscope::State::beam(const std::optional<double>& kvp) {
    const auto [place, is_new] = beams.try_emplace(kvp.value_or(0.0));
    BeamImages& result = place->second;
    if (!is_new) return result;
    const CArm& arm = pose->arm;
    // The voltage belongs to the usual dose, so that a change of dose does not change the contrast.
    const double voltage =
        kvp ? *kvp : automatic_exposure([this](double kv) { return usual_dose * charge(kv); }).kvp;
    result.technique.kvp = voltage;
    result.bins = fit_bins(detected_spectrum(voltage));

    const std::size_t count = pose->flat.values.size();
    std::vector<PixelBins> exponent(count, PixelBins{});
    for (const Mixture& m : pose->mixtures) {
        const Bins own = result.bins.attenuation(m.material), around = result.bins.attenuation(m.inside);
        PixelBins change;
        for (int k = 0; k < energy_bins; ++k) change[k] = static_cast<float>(own[k] - around[k]);
        for (std::size_t i = 0; i < count; ++i) {
            const float length = m.length.values[i];
            if (length == 0.0f) continue;
            for (int k = 0; k < energy_bins; ++k) exponent[i][k] -= change[k] * length;
        }
    }
    result.primary.resize(count);
    Field relative(arm.pixels, arm.pixels), lit(arm.pixels, arm.pixels);
    for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < energy_bins; ++k) {
            result.primary[i][k] =
                pose->flat.values[i] * static_cast<float>(result.bins.weights[k]) * std::exp(exponent[i][k]);
        }
        relative.values[i] = sum(result.primary[i]);
        lit.values[i] = pose->open.values[i] * relative.values[i];
    }

    // Scatter: the primary image spread wide. What the collimator keeps out scatters nowhere.
    const int block = std::max(1, arm.pixels / 64);
    result.scatter =
        enlarge(gaussian_blur(shrink(lit, block), config.scatter_reach / pixel_width(arm) / block), block,
                arm.pixels, arm.pixels);
    for (float& value : result.scatter.values) value *= static_cast<float>(config.scatter_to_primary);

    // Automatic exposure: one nGy on average in the measuring field; each frame scales it to its dose.
    double field = 0.0, received = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        field += pose->measured.values[i];
        received +=
            static_cast<double>(pose->measured.values[i]) * (relative.values[i] + result.scatter.values[i]);
    }
    const double quanta = quanta_per_dose_and_area * pixel_width(arm) * pixel_width(arm);
    result.gain = received > 0.0 ? quanta * field / received : 0.0;
    return result;
}

const BareImage& Fluoroscope::State::bare_image(const Exposure& exposure) {
    const auto [place, is_new] = bare.try_emplace({exposure.kvp.value_or(0.0), exposure.detector_dose});
    BareImage& result = place->second;
    if (!is_new) return result;

    const CArm& arm = pose->arm;
    const BeamImages& at = beam(exposure.kvp);
    const double kvp = at.technique.kvp;
    result.technique = exposure_at(kvp, exposure.detector_dose * charge(kvp));
    const double metres = 1e-3 * std::max(arm.sod - reference_point, 1.0);
    const double charge = 1e-3 * result.technique.current * result.technique.pulse_width;  // [mAs]
    const double at_one_metre = kerma_per_charge(kvp) * charge;                            // [mGy]
    result.technique.air_kerma = at_one_metre / (metres * metres);
    constexpr double Gy_cm2_per_mGy_mm2 = 1e-5;
    result.technique.area_product =
        at_one_metre * open_area(arm) / (1e-6 * arm.sid * arm.sid) * Gy_cm2_per_mGy_mm2;

    result.scale = static_cast<float>(at.gain * exposure.detector_dose * result.technique.delivered);
    result.expected = Field(arm.pixels, arm.pixels);
    for (std::size_t i = 0; i < result.expected.values.size(); ++i)
        result.expected.values[i] = result.scale * (sum(at.primary[i]) + at.scatter.values[i]);
    // The display is adjusted to the image without contrast.
    result.display.emplace(config.display, result.expected, pose->flat, pose->measured, pose->open);
    return result;
}

/// Leaves in `iodine` what the beam meets, and in `iodine_pixels` where.
void Fluoroscope::State::dissolve(const Exposure& exposure) {
    const int pixels = pose->arm.pixels;
    iodine_pixels.clear();
    if (vessels && (exposure.iodine > 0.0 || !exposure.vessel_iodine.empty())) {
        dissolve_in_vessels(exposure);
    } else {
        iodine = Field(pixels, pixels);
        if (exposure.iodine > 0.0) {
            for (const std::uint32_t i : pose->contrast_pixels)
                iodine.values[i] = static_cast<float>(exposure.iodine) * pose->contrast_length.values[i];
        }
    }
    for (const OrganIodine& organ : exposure.organs) {
        const auto found = pose->organs.find(organ.layer);
        if (found == pose->organs.end() || !(organ.iodine > 0.0)) continue;
        for (std::size_t i = 0; i < iodine.values.size(); ++i)
            iodine.values[i] += static_cast<float>(organ.iodine) * found->second.values[i];
    }
    for (std::uint32_t i = 0; i < iodine.values.size(); ++i)
        if (iodine.values[i] > 0.0f) iodine_pixels.push_back(i);
}

void Fluoroscope::State::dissolve_in_vessels(const Exposure& exposure) {
    if (!pose->vessels) pose->vessels = vessels->at(pose->arm);
    const std::span<const Vec3> nodes = vessels->nodes();
    std::vector<float> concentration(nodes.size(), static_cast<float>(exposure.iodine));
    for (std::size_t i = 0; i < std::min(nodes.size(), exposure.vessel_iodine.size()); ++i)
        concentration[i] += exposure.vessel_iodine[i];
    if (exposure.vessel_shift.isZero()) {
        iodine_thickness(*pose->vessels, concentration, iodine);
        return;
    }
    std::vector<Vec3> moved(nodes.begin(), nodes.end());
    for (Vec3& node : moved) node += exposure.vessel_shift;
    iodine_thickness(*pose->vessels, concentration, pixel_shifts(pose->arm, nodes, moved), iodine);
}

Fluoroscope::Fluoroscope(FluoroscopeConfig config, std::vector<TissueLayer> layers,
                         std::optional<LumenContrast> vessels)
    : state_(std::make_unique<State>()) {
    state_->config = std::move(config);
    state_->vessels = std::move(vessels);
    for (TissueLayer& layer : layers) {
        require_closed(layer.name, layer.mesh);
        if (layer.takes_contrast) require_simple(layer.name, layer.mesh);
        state_->renderer.add(layer.mesh);
        layer.mesh = {};
    }
    state_->layers = std::move(layers);
}

Fluoroscope::~Fluoroscope() = default;
Fluoroscope::Fluoroscope(Fluoroscope&&) noexcept = default;
Fluoroscope& Fluoroscope::operator=(Fluoroscope&&) noexcept = default;

namespace {

void require(const CArm& arm, const Exposure& exposure) {
    std::string wrong;
    for (const auto& found : {problems(arm), problems(exposure)}) {
        for (const std::string& sentence : found) wrong += (wrong.empty() ? "" : "; ") + sentence;
    }
    if (!wrong.empty()) throw std::invalid_argument(wrong);
}

}  // namespace

Field Fluoroscope::expected_quanta(const CArm& arm, std::span<const Vec3> joints, const Exposure& exposure) {
    require(arm, exposure);
    State& state = *state_;
    state.move_to(arm);
    const BareImage& bare = state.bare_image(exposure);
    const BeamImages& beam = state.beam(exposure.kvp);
    Field expected = bare.expected;

    state.dissolve(exposure);
    const Bins per_concentration = beam.bins.attenuation(Material::iodine);
    PixelBins per_iodine;
    for (int k = 0; k < energy_bins; ++k) per_iodine[k] = static_cast<float>(-per_concentration[k]);
    /// Primary quanta behind the iodine.
    const auto primary = [&](std::uint32_t pixel) {
        PixelBins bins = beam.primary[pixel];
        const float amount = state.iodine.values[pixel];
        for (int k = 0; k < energy_bins; ++k)
            bins[k] *= bare.scale * (amount > 0.0f ? std::exp(per_iodine[k] * amount) : 1.0f);
        return bins;
    };
    for (const std::uint32_t pixel : state.iodine_pixels)
        expected.values[pixel] = sum(primary(pixel)) + bare.scale * beam.scatter.values[pixel];

    // The wire displaces blood and what is dissolved in it; it is taken to lie in a vessel all along.
    Bins displaced = beam.bins.attenuation(Material::blood);
    const double dissolved = exposure.iodine + exposure.wire_iodine;
    for (int k = 0; k < energy_bins; ++k) displaced[k] += dissolved * per_concentration[k];
    const WireLook& look = state.config.wire;
    for (const WirePixel& pixel : state.wire.cast(shifted(arm, exposure.vessel_shift), joints, look,
                                                  wire_attenuation(look, beam.bins, displaced))) {
        const PixelBins quanta = primary(pixel.index);
        for (int k = 0; k < energy_bins; ++k)
            expected.values[pixel.index] -= quanta[k] * (1.0f - pixel.transmission[k]);
    }
    return expected;
}

Field Fluoroscope::read(const CArm& arm, std::span<const Vec3> joints, const Exposure& exposure) {
    return read_out(expected_quanta(arm, joints, exposure), pixel_width(arm), state_->config.detector,
                    exposure.seed, exposure.frame);
}

const Display& Fluoroscope::display(const CArm& arm, const Exposure& exposure) {
    require(arm, exposure);
    state_->move_to(arm);
    return *state_->bare_image(exposure).display;
}

GrayImage Fluoroscope::expose(const CArm& arm, std::span<const Vec3> joints, const Exposure& exposure) {
    const Field signal = read(arm, joints, exposure);
    return display(arm, exposure).show(signal);
}

Field Fluoroscope::opening(const CArm& arm) const {
    return shutters(state_->config.display, arm);
}

Technique Fluoroscope::technique(const CArm& arm, const Exposure& exposure) {
    require(arm, exposure);
    state_->move_to(arm);
    return state_->bare_image(exposure).technique;
}

std::vector<std::uint32_t> Fluoroscope::wire_pixels(const CArm& arm, std::span<const Vec3> joints,
                                                    const Vec3& shift) {
    require(arm, {});
    const EnergyBins bins = fit_bins(detected_spectrum(74.0));
    const WireLook& look = state_->config.wire;
    const Bins blood = bins.attenuation(Material::blood);
    std::vector<std::uint32_t> shadowed;
    for (const WirePixel& pixel :
         state_->wire.cast(shifted(arm, shift), joints, look, wire_attenuation(look, bins, blood))) {
        if (pixel.transmission[0] < 0.98f) shadowed.push_back(pixel.index);
    }
    std::sort(shadowed.begin(), shadowed.end());
    return shadowed;
}

std::vector<std::uint32_t> Fluoroscope::vessel_pixels(const CArm& arm, const Vec3& shift) {
    require(arm, {});
    Field through(arm.pixels, arm.pixels);
    for (std::size_t layer = 0; layer < state_->layers.size(); ++layer) {
        if (!state_->layers[layer].takes_contrast) continue;
        const Field length = state_->renderer.render(static_cast<int>(layer), shifted(arm, shift)).length;
        for (std::size_t i = 0; i < length.values.size(); ++i) through.values[i] += length.values[i];
    }
    std::vector<std::uint32_t> pixels;
    for (std::uint32_t i = 0; i < through.values.size(); ++i)
        if (through.values[i] > 0.0f) pixels.push_back(i);
    return pixels;
}

int Fluoroscope::unbalanced_pixels() const {
    return state_->pose ? state_->pose->unbalanced_pixels : 0;
}

}  // namespace render
