#include "render/fluoroscope.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "render/filter.h"
#include "render/path_length.h"

namespace render {

using physics::Vec3;

namespace {

using PixelBins = std::array<float, energy_bins>;

/// What the pose and the tube voltage determine, and the mesh passes cost time for.
struct PoseImages {
    CArm arm;
    double kvp = 0.0;
    EnergyBins bins;
    std::vector<PixelBins> primary;  // per pixel and bin, relative to the open beam, flat field included
    Field contrast_length;           // through layers that take contrast [mm]
    std::vector<std::uint32_t> contrast_pixels;  // where that is not 0
    double gain = 0.0;                           // quanta per unit of relative intensity
    Field scatter;                               // [quanta]
    std::optional<Display> display;
    int unbalanced_pixels = 0;
};

/// What iodine adds to that.
struct FilledImages {
    double iodine = 0.0;
    double dose = 0.0;
    std::vector<PixelBins> primary;  // as above, scaled to quanta, behind the iodine
    Field expected;                  // with scatter, without the wire [quanta]
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
    if (!(exposure.kvp >= 40.0 && exposure.kvp <= 125.0)) {
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
    WireImage wire;
    std::optional<PoseImages> pose;
    std::optional<FilledImages> filled;

    const PoseImages& at_pose(const CArm& arm, double kvp);
    const FilledImages& with_iodine(const PoseImages&, const Exposure&);
};

const PoseImages& Fluoroscope::State::at_pose(const CArm& arm, double kvp) {
    if (pose && pose->arm == arm && pose->kvp == kvp) return *pose;
    filled.reset();
    pose.emplace();
    pose->arm = arm;
    pose->kvp = kvp;
    pose->bins = fit_bins(detected_spectrum(kvp));

    const Field flat = flat_field(arm, config.heel);
    const std::size_t count = flat.values.size();
    std::vector<PixelBins> exponent(count, PixelBins{});
    pose->contrast_length = Field(arm.pixels, arm.pixels);
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        const PathLengthRenderer::Result path = renderer.render(static_cast<int>(layer), arm);
        pose->unbalanced_pixels += path.unbalanced_pixels;
        const Bins own = pose->bins.attenuation(layers[layer].material);
        const Bins around = pose->bins.attenuation(layers[layer].inside);
        PixelBins change;
        for (int k = 0; k < energy_bins; ++k) change[k] = static_cast<float>(own[k] - around[k]);
        for (std::size_t i = 0; i < count; ++i) {
            const float length = path.length.values[i];
            if (length == 0.0f) continue;
            for (int k = 0; k < energy_bins; ++k) exponent[i][k] -= change[k] * length;
            if (layers[layer].takes_contrast) pose->contrast_length.values[i] += length;
        }
    }

    pose->primary.resize(count);
    Field relative(arm.pixels, arm.pixels);
    for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < energy_bins; ++k) {
            pose->primary[i][k] =
                flat.values[i] * static_cast<float>(pose->bins.weights[k]) * std::exp(exponent[i][k]);
        }
        relative.values[i] = sum(pose->primary[i]);
        if (pose->contrast_length.values[i] > 0.0f)
            pose->contrast_pixels.push_back(static_cast<std::uint32_t>(i));
    }

    // Scatter: the primary image spread wide.
    constexpr int block = 16;
    pose->scatter =
        enlarge(gaussian_blur(shrink(relative, block), config.scatter_reach / pixel_width(arm) / block),
                block, arm.pixels, arm.pixels);
    for (float& value : pose->scatter.values) value *= static_cast<float>(config.scatter_to_primary);

    // Automatic exposure: one nGy on average in the measuring field; each frame scales it to its dose.
    const Field measured = measuring_field(arm, config.measuring_radius);
    double field = 0.0, received = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        field += measured.values[i];
        received += static_cast<double>(measured.values[i]) * (relative.values[i] + pose->scatter.values[i]);
    }
    const double quanta = quanta_per_dose_and_area * pixel_width(arm) * pixel_width(arm);
    pose->gain = received > 0.0 ? quanta * field / received : 0.0;
    return *pose;
}

const FilledImages& Fluoroscope::State::with_iodine(const PoseImages& at, const Exposure& exposure) {
    if (filled && filled->iodine == exposure.iodine && filled->dose == exposure.detector_dose) return *filled;
    const bool new_dose = !filled || filled->dose != exposure.detector_dose;
    if (!filled) filled.emplace();  // otherwise its memory is used again: contrast flows for many frames
    filled->iodine = exposure.iodine;
    filled->dose = exposure.detector_dose;
    const std::size_t count = at.primary.size();
    filled->primary.resize(count);
    filled->expected.width = filled->expected.height = at.arm.pixels;
    filled->expected.values.resize(count);

    const auto scale = static_cast<float>(at.gain * exposure.detector_dose);
    if (new_dose) {
        // The display is adjusted to the image without contrast.
        Field bare(at.arm.pixels, at.arm.pixels);
        for (std::size_t i = 0; i < count; ++i) {
            bare.values[i] = scale * (sum(at.primary[i]) + at.scatter.values[i]);
        }
        pose->display.emplace(config.display, bare, flat_field(at.arm, config.heel),
                              measuring_field(at.arm, config.measuring_radius));
    }
    PixelBins iodine;
    const Bins per_concentration = at.bins.attenuation(Material::iodine);
    for (int k = 0; k < energy_bins; ++k)
        iodine[k] = static_cast<float>(-exposure.iodine * per_concentration[k]);
    const auto fill = [&](std::size_t i) {
        PixelBins bins = at.primary[i];
        for (float& value : bins) value *= scale;
        const float length = at.contrast_length.values[i];
        if (length > 0.0f && exposure.iodine > 0.0) {
            for (int k = 0; k < energy_bins; ++k) bins[k] *= std::exp(iodine[k] * length);
        }
        filled->primary[i] = bins;
        filled->expected.values[i] = sum(bins) + scale * at.scatter.values[i];
    };
    if (new_dose) {
        for (std::size_t i = 0; i < count; ++i) fill(i);
    } else {
        for (const std::uint32_t i : at.contrast_pixels) fill(i);
    }
    return *filled;
}

Fluoroscope::Fluoroscope(FluoroscopeConfig config, std::vector<TissueLayer> layers)
    : state_(std::make_unique<State>()) {
    state_->config = std::move(config);
    for (TissueLayer& layer : layers) {
        require_closed(layer.name, layer.mesh);
        state_->renderer.add(layer.mesh);
        layer.mesh = {};
    }
    state_->layers = std::move(layers);
}

Fluoroscope::~Fluoroscope() = default;
Fluoroscope::Fluoroscope(Fluoroscope&&) noexcept = default;
Fluoroscope& Fluoroscope::operator=(Fluoroscope&&) noexcept = default;

Field Fluoroscope::expected_quanta(const CArm& arm, std::span<const Vec3> joints, const Exposure& exposure) {
    std::string wrong;
    for (const auto& found : {problems(arm), problems(exposure)}) {
        for (const std::string& sentence : found) wrong += (wrong.empty() ? "" : "; ") + sentence;
    }
    if (!wrong.empty()) throw std::invalid_argument(wrong);

    State& state = *state_;
    const PoseImages& pose = state.at_pose(arm, exposure.kvp);
    const FilledImages& filled = state.with_iodine(pose, exposure);
    Field expected = filled.expected;

    // The wire displaces blood and what is dissolved in it; it is taken to lie in a vessel all along.
    Bins displaced = pose.bins.attenuation(Material::blood);
    const Bins iodine = pose.bins.attenuation(Material::iodine);
    for (std::size_t k = 0; k < displaced.size(); ++k) displaced[k] += exposure.iodine * iodine[k];
    const WireLook& look = state.config.wire;
    for (const WirePixel& pixel :
         state.wire.cast(arm, joints, look, wire_attenuation(look, pose.bins, displaced))) {
        const PixelBins& primary = filled.primary[pixel.index];
        float& quanta = expected.values[pixel.index];
        for (int k = 0; k < energy_bins; ++k) quanta -= primary[k] * (1.0f - pixel.transmission[k]);
    }
    return expected;
}

GrayImage Fluoroscope::expose(const CArm& arm, std::span<const Vec3> joints, const Exposure& exposure) {
    const Field signal = read_out(expected_quanta(arm, joints, exposure), pixel_width(arm),
                                  state_->config.detector, exposure.seed, exposure.frame);
    return state_->pose->display->show(signal);
}

int Fluoroscope::unbalanced_pixels() const {
    return state_->pose ? state_->pose->unbalanced_pixels : 0;
}

}  // namespace render
