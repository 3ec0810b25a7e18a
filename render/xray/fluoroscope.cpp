#include "render/xray/fluoroscope.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "render/picture/fast_exp.h"
#include "render/xray/beam_images.h"
#include "render/xray/exposure_meter.h"
#include "render/xray/path_length.h"
#include "render/xray/scatter.h"

namespace render {

using geometry::Vec3;

namespace {

/// The image with neither contrast nor wire at one dose.
struct BareImage {
    float scale = 0.0f;  // quanta per unit of BeamImages
    Field expected;      // with scatter [quanta]
    Technique technique;
    std::optional<Display> display;
};

/// Whether images of the two differ only by rotation and by what lies in the isocentre.
bool same_plane(CArm a, const CArm& b) {
    a.lao = b.lao;
    a.cranial = b.cranial;
    a.isocentre = b.isocentre;
    return a == b;
}

/// Lengths through volumes, which cost most of a pose and do not depend on the collimator.
class VolumeImages {
public:
    void add_to(PoseImages& pose, std::span<const VolumeCaster> volumes) {
        CArm open = pose.arm;
        open.opening_width = open.opening_height = widest_opening;
        if (!arm_ || !(*arm_ == open)) {
            lengths_.clear();
            for (const VolumeCaster& volume : volumes) lengths_.push_back(volume.lengths(open));
            arm_ = open;
        }
        for (std::size_t v = 0; v < volumes.size(); ++v)
            for (std::size_t p = 0; p < lengths_[v].size(); ++p)
                add_length(pose.mixtures, volumes[v].parts()[p].material, volumes[v].parts()[p].inside,
                           lengths_[v][p]);
    }

private:
    std::optional<CArm> arm_;                  // of the lengths, with an open collimator
    std::vector<std::vector<Field>> lengths_;  // of each volume and part [mm]
};

std::vector<VolumeCaster> casters_of(std::vector<DensityVolume> volumes) {
    std::vector<VolumeCaster> casters;
    for (DensityVolume& volume : volumes) casters.emplace_back(std::move(volume));
    return casters;
}

/// The arm as seen from shifted objects.
CArm shifted(CArm arm, const Vec3& shift) {
    arm.isocentre -= shift;
    return arm;
}

}  // namespace

std::vector<std::string> problems(const Exposure& exposure) {
    std::vector<std::string> found;
    if (!(exposure.detector_dose > 0.0 && exposure.detector_dose <= largest_detector_dose)) {
        found.emplace_back("the detector dose must be above 0 and at most 100000 nGy");
    }
    if (exposure.kvp && !(*exposure.kvp >= 40.0 && *exposure.kvp <= 125.0)) {
        found.emplace_back("the tube voltage must lie within 40 and 125 kV");
    }
    if (!(exposure.iodine >= 0.0 && exposure.iodine <= largest_iodine)) {
        found.emplace_back("the iodine concentration must lie within 0 and " +
                           std::to_string(static_cast<int>(largest_iodine)) + " mg/ml");
    }
    for (const double share : {exposure.breath, exposure.beat}) {
        if (!(share >= 0.0 && share <= 1.0))
            found.emplace_back("the shares of breath and heartbeat must lie within 0 and 1");
    }
    return found;
}

struct Fluoroscope::State {
    FluoroscopeConfig config;
    int threads = 1;
    ExposureMeter meter;
    std::vector<TissueLayer> layers;  // their meshes have been moved to the renderer
    PathLengthRenderer renderer;
    std::optional<LumenContrast> vessels;
    std::optional<DistalVessels> distal;
    std::vector<VolumeCaster> volumes;
    VolumeImages volume_images;
    WireImage wire;
    std::optional<PlaneImages> plane;
    std::optional<PoseImages> pose;
    std::map<double, BeamImages> beams;                   // of the pose, by requested voltage; 0 = automatic
    std::map<std::pair<double, double>, BareImage> bare;  // of the pose, by voltage and dose
    std::map<int, MovedLengths> moved;                    // of the pose, by phase
    std::map<std::pair<double, int>, std::vector<PixelBins>> moved_exponents;  // by voltage and phase
    std::vector<std::uint32_t> moving_pixels;                                  // that any of these changes
    std::vector<PixelBins> moved_primary;                                      // scratch of primary_at
    double moved_primary_of = -1.0;            // the requested voltage of that
    Field iodine;                              // scratch: iodine in the beam [mg/ml·mm]
    std::vector<std::uint32_t> iodine_pixels;  // pixels where that is not 0

    State(const FluoroscopeConfig& chosen, std::span<const TissueLayer> around,
          std::vector<VolumeCaster> through)
        : config(chosen), meter(chosen, around, through), volumes(std::move(through)) {}
    /// The vessels as seen from an arm that may be shifted, for ground truth.
    struct VesselView {
        CArm arm;
        std::vector<std::uint32_t> pixels;
        std::optional<ContrastMatrix> lengths;  // made when labels first need it
    };
    std::optional<VesselView> vessel_view;

    VesselView& view_of_vessels(const CArm&);
    void move_to(const CArm&);
    const BeamImages& beam(const std::optional<double>& kvp);
    const BareImage& bare_image(const Exposure&);
    /// A cached phase of breath or heartbeat, and its weight in the blend.
    struct PhasePart {
        int phase;
        double weight;
    };
    std::vector<PhasePart> phase_parts(const Exposure&);
    const MovedLengths& moved_to(int phase);
    const std::vector<PixelBins>& exponents_of(const Exposure&, int phase);
    const std::vector<PixelBins>& primary_at(const Exposure&);
    void dissolve_in_organ(const OrganIodine&, const Exposure&);
    void dissolve(const Exposure&);
    void dissolve_in_vessels(const Exposure&);
    void dissolve_in_distal(const Exposure&);
    void dissolve_in(const SparseLength&, float concentration);
};

void Fluoroscope::State::move_to(const CArm& arm) {
    if (pose && pose->arm == arm) return;
    beams.clear();
    bare.clear();
    moved.clear();
    moved_exponents.clear();
    moving_pixels.clear();
    moved_primary_of = -1.0;
    if (!plane || !same_plane(plane->arm, arm)) plane = plane_images(config, arm);
    pose = pose_images(renderer, layers, vessels.has_value(), arm);
    volume_images.add_to(*pose, volumes);
}

const BeamImages& Fluoroscope::State::beam(const std::optional<double>& kvp) {
    const auto [place, is_new] = beams.try_emplace(kvp.value_or(0.0));
    if (is_new) {
        const double voltage = meter.voltage(pose->arm, kvp);
        place->second = beam_images(*plane, *pose, voltage, meter.scatter(pose->arm, voltage));
    }
    return place->second;
}

const BareImage& Fluoroscope::State::bare_image(const Exposure& exposure) {
    const auto [place, is_new] = bare.try_emplace({exposure.kvp.value_or(0.0), exposure.detector_dose});
    BareImage& result = place->second;
    if (!is_new) return result;

    const CArm& arm = pose->arm;
    const BeamImages& at = beam(exposure.kvp);
    result.technique = meter.technique(arm, exposure);
    result.scale = static_cast<float>(at.gain * exposure.detector_dose * result.technique.delivered);
    result.expected = Field(arm.pixels, arm.pixels);
    for (std::size_t i = 0; i < result.expected.values.size(); ++i)
        result.expected.values[i] = result.scale * (sum(at.primary[i]) + at.scatter.values[i]);
    // The display is adjusted to the image without contrast.
    result.display.emplace(config.display, result.expected, plane->flat, at.weights, plane->open);
    return result;
}

namespace {

constexpr int breath_phases = 4, beat_phases = 3;  // cached, besides rest

}  // namespace

/// Breath's phases are 1 to breath_phases, the heart's follow. Between two of them images are blended.
std::vector<Fluoroscope::State::PhasePart> Fluoroscope::State::phase_parts(const Exposure& exposure) {
    std::vector<PhasePart> parts;
    const auto add = [&](double share, int count, int first) {
        const double at = std::clamp(share, 0.0, 1.0) * count;
        const int below = std::min(static_cast<int>(at), count - 1);
        const double t = at - below;
        if (below > 0 && t < 1.0) parts.push_back({first + below, 1.0 - t});
        if (t > 0.0) parts.push_back({first + below + 1, t});
    };
    const auto any = [&](auto member) {
        return std::any_of(layers.begin(), layers.end(),
                           [&](const TissueLayer& layer) { return !(layer.*member).empty(); });
    };
    if (exposure.breath > 0.0 && any(&TissueLayer::breath)) add(exposure.breath, breath_phases, 0);
    if (exposure.beat > 0.0 && any(&TissueLayer::beat)) add(exposure.beat, beat_phases, breath_phases);
    return parts;
}

const MovedLengths& Fluoroscope::State::moved_to(int phase) {
    const auto [place, is_new] = moved.try_emplace(phase);
    if (!is_new) return place->second;
    PathLengthRenderer::Phase at;
    if (phase <= breath_phases)
        at.breath = static_cast<double>(phase) / breath_phases;
    else
        at.beat = static_cast<double>(phase - breath_phases) / beat_phases;
    place->second = moved_lengths(renderer, layers, *pose, at);
    std::vector<bool> moving(static_cast<std::size_t>(pose->arm.pixels) * pose->arm.pixels, false);
    for (const std::uint32_t pixel : moving_pixels) moving[pixel] = true;
    for (const Field& change : place->second.changes)
        for (std::size_t i = 0; i < change.values.size(); ++i)
            if (change.values[i] != 0.0f) moving[i] = true;
    moving_pixels.clear();
    for (std::uint32_t i = 0; i < moving.size(); ++i)
        if (moving[i]) moving_pixels.push_back(i);
    return place->second;
}

/// Exponents that the phase adds to those of the beam at rest, for every pixel.
const std::vector<PixelBins>& Fluoroscope::State::exponents_of(const Exposure& exposure, int phase) {
    const auto [place, is_new] = moved_exponents.try_emplace({exposure.kvp.value_or(0.0), phase});
    if (!is_new) return place->second;
    const MovedLengths& there = moved_to(phase);
    const BeamImages& at = beam(exposure.kvp);
    std::vector<PixelBins>& exponents = place->second;
    exponents.assign(at.primary.size(), PixelBins{});
    for (std::size_t m = 0; m < there.changes.size(); ++m) {
        const Field& change = there.changes[m];
        if (change.values.empty()) continue;
        const PixelBins per_mm = change_of(pose->mixtures[m], at.bins);
        for (std::size_t i = 0; i < change.values.size(); ++i)
            for (int k = 0; k < energy_bins; ++k) exponents[i][k] -= per_mm[k] * change.values[i];
    }
    return exponents;
}

/// The beam's primary with its organs where breath and heartbeat have them. At rest it is the beam's own.
const std::vector<PixelBins>& Fluoroscope::State::primary_at(const Exposure& exposure) {
    const BeamImages& at = beam(exposure.kvp);
    const std::vector<PhasePart> parts = phase_parts(exposure);
    if (parts.empty()) return at.primary;
    std::vector<const PixelBins*> exponents;
    for (const PhasePart& part : parts) exponents.push_back(exponents_of(exposure, part.phase).data());
    // Pixels that do not move keep the beam's values from one frame to the next.
    if (moved_primary_of != exposure.kvp.value_or(0.0)) moved_primary = at.primary;
    moved_primary_of = exposure.kvp.value_or(0.0);
    constexpr std::size_t together = 256;
    std::array<float, together * energy_bins> factors;
    for (std::size_t start = 0; start < moving_pixels.size(); start += together) {
        const auto pixels =
            std::span(moving_pixels).subspan(start, std::min(together, moving_pixels.size() - start));
        std::fill_n(factors.begin(), pixels.size() * energy_bins, 0.0f);
        for (std::size_t p = 0; p < parts.size(); ++p) {
            const float weight = static_cast<float>(parts[p].weight);
            for (std::size_t i = 0; i < pixels.size(); ++i)
                for (int k = 0; k < energy_bins; ++k)
                    factors[i * energy_bins + k] += weight * exponents[p][pixels[i]][k];
        }
        exponentiate(std::span(factors).first(pixels.size() * energy_bins));
        for (std::size_t i = 0; i < pixels.size(); ++i)
            for (int k = 0; k < energy_bins; ++k)
                moved_primary[pixels[i]][k] = at.primary[pixels[i]][k] * factors[i * energy_bins + k];
    }
    return moved_primary;
}

/// Where an organ is between its cached phases its iodine is shared among them; none is made.
void Fluoroscope::State::dissolve_in_organ(const OrganIodine& organ, const Exposure& exposure) {
    const auto found = pose->organs.find(organ.layer);
    if (found == pose->organs.end() || !(organ.iodine > 0.0)) return;
    double at_rest = 1.0;
    for (const PhasePart& part : phase_parts(exposure)) {
        const std::map<int, SparseLength>& there = moved_to(part.phase).organs;
        const auto moves = there.find(organ.layer);
        if (moves == there.end()) continue;
        // Breath comes first; what is left is the heartbeat's.
        const double weight = std::min(part.weight, at_rest);
        at_rest -= weight;
        if (weight > 0.0) dissolve_in(moves->second, static_cast<float>(weight * organ.iodine));
    }
    if (at_rest > 0.0) dissolve_in(found->second, static_cast<float>(at_rest * organ.iodine));
}

/// Writes the iodine in the beam to `iodine`, and the pixels that have any to `iodine_pixels`.
void Fluoroscope::State::dissolve(const Exposure& exposure) {
    const int pixels = pose->arm.pixels;
    if (iodine.width != pixels) {
        iodine = Field(pixels, pixels);
    } else {
        for (const std::uint32_t i : iodine_pixels) iodine.values[i] = 0.0f;
    }
    iodine_pixels.clear();
    if (vessels && (exposure.iodine > 0.0 || !exposure.vessel_iodine.empty())) {
        dissolve_in_vessels(exposure);
    } else if (exposure.iodine > 0.0) {
        dissolve_in(pose->contrast, static_cast<float>(exposure.iodine));
    }
    if (distal) dissolve_in_distal(exposure);
    for (const OrganIodine& organ : exposure.organs) dissolve_in_organ(organ, exposure);
}

void Fluoroscope::State::dissolve_in_distal(const Exposure& exposure) {
    const std::vector<float>& there = exposure.distal_iodine;
    if (std::none_of(there.begin(), there.end(), [](float c) { return c > 1e-3f; })) return;
    if (!pose->distal) pose->distal = distal->at(pose->arm);
    std::vector<PixelShift> shifts;
    if (!exposure.vessel_shift.isZero()) {
        std::vector<Vec3> places = pose->distal->middle;
        for (Vec3& node : places) node += exposure.vessel_shift;
        shifts = pixel_shifts(pose->arm, pose->distal->middle, places);
    }
    add_iodine(*pose->distal, there, shifts, iodine, iodine_pixels);
}

void Fluoroscope::State::dissolve_in(const SparseLength& layer, float concentration) {
    for (std::size_t i = 0; i < layer.pixels.size(); ++i) {
        float& there = iodine.values[layer.pixels[i]];
        if (there == 0.0f) iodine_pixels.push_back(layer.pixels[i]);
        there += concentration * layer.lengths[i];
    }
}

void Fluoroscope::State::dissolve_in_vessels(const Exposure& exposure) {
    if (!pose->vessels) pose->vessels = vessels->at(pose->arm);
    const std::span<const Vec3> nodes = vessels->nodes();
    std::vector<float> concentration(nodes.size(), static_cast<float>(exposure.iodine));
    for (std::size_t i = 0; i < std::min(nodes.size(), exposure.vessel_iodine.size()); ++i)
        concentration[i] += exposure.vessel_iodine[i];
    std::vector<Eigen::Vector3f> streams = exposure.vessel_streams;
    if (!streams.empty()) streams.resize(nodes.size(), Eigen::Vector3f::Zero());
    if (exposure.vessel_shift.isZero()) {
        iodine_thickness(*pose->vessels, concentration, iodine, streams);
        for (const std::uint32_t i : pose->vessels->pixels)
            if (iodine.values[i] > 0.0f) iodine_pixels.push_back(i);
        return;
    }
    std::vector<Vec3> places(nodes.begin(), nodes.end());
    for (Vec3& node : places) node += exposure.vessel_shift;
    iodine_thickness(*pose->vessels, concentration, pixel_shifts(pose->arm, nodes, places), iodine, streams);
    for (std::uint32_t i = 0; i < iodine.values.size(); ++i)
        if (iodine.values[i] > 0.0f) iodine_pixels.push_back(i);
}

Fluoroscope::Fluoroscope(FluoroscopeConfig config, std::vector<TissueLayer> layers,
                         std::optional<LumenContrast> vessels, std::optional<DistalVessels> distal,
                         std::vector<DensityVolume> volumes)
    : state_(std::make_unique<State>(config, layers, casters_of(std::move(volumes)))) {
    state_->vessels = std::move(vessels);
    state_->distal = std::move(distal);
    for (TissueLayer& layer : layers) {
        require_closed(layer.name, layer.mesh);
        if (layer.takes_contrast) require_simple(layer.name, layer.mesh);
        state_->renderer.add(layer.mesh, layer.breath, layer.beat);
        layer.mesh = {};
    }
    state_->layers = std::move(layers);
}

Fluoroscope::~Fluoroscope() = default;
Fluoroscope::Fluoroscope(Fluoroscope&&) noexcept = default;
Fluoroscope& Fluoroscope::operator=(Fluoroscope&&) noexcept = default;

Field Fluoroscope::expected_quanta(const CArm& arm, const SeenDevices& devices, const Exposure& exposure) {
    require_usable(arm, exposure);
    State& state = *state_;
    state.move_to(arm);
    const BareImage& bare = state.bare_image(exposure);
    const BeamImages& beam = state.beam(exposure.kvp);
    Field expected = bare.expected;
    const std::vector<PixelBins>& primary = state.primary_at(exposure);
    if (&primary != &beam.primary) {
        for (const std::uint32_t pixel : state.moving_pixels)
            expected.values[pixel] = bare.scale * (sum(primary[pixel]) + beam.scatter.values[pixel]);
    }

    state.dissolve(exposure);
    const Bins per_concentration = beam.bins.attenuation(Material::Iodine);
    PixelBins per_iodine;
    for (int k = 0; k < energy_bins; ++k) per_iodine[k] = static_cast<float>(-per_concentration[k]);
    // Processes many pixels at once, to vectorise the exponentials.
    constexpr std::size_t together = 256;
    std::array<float, together * energy_bins> transmission;
    const std::span<const std::uint32_t> dissolved_in = state.iodine_pixels;
    for (std::size_t start = 0; start < dissolved_in.size(); start += together) {
        const auto pixels = dissolved_in.subspan(start, std::min(together, dissolved_in.size() - start));
        // They lie too far apart for the processor to prefetch by itself.
        for (const std::uint32_t pixel : pixels) __builtin_prefetch(&primary[pixel]);
        for (std::size_t i = 0; i < pixels.size(); ++i)
            for (int k = 0; k < energy_bins; ++k)
                transmission[i * energy_bins + k] = per_iodine[k] * state.iodine.values[pixels[i]];
        exponentiate(std::span(transmission).first(pixels.size() * energy_bins));
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            float passed = beam.scatter.values[pixels[i]];
            for (int k = 0; k < energy_bins; ++k)
                passed += primary[pixels[i]][k] * transmission[i * energy_bins + k];
            expected.values[pixels[i]] = bare.scale * passed;
        }
    }

    // Devices displace blood and what is dissolved in it; they are assumed to lie in a vessel over their
    // whole length.
    Bins displaced = beam.bins.attenuation(Material::Blood);
    const double dissolved = exposure.iodine + exposure.wire_iodine;
    for (int k = 0; k < energy_bins; ++k) displaced[k] += dissolved * per_concentration[k];
    const WireLook &wire = devices.wire_look ? *devices.wire_look : state.config.wire,
                   &catheter = state.config.catheter;
    const WireShadow shadows[] = {
        {devices.wire, wire, wire_attenuation(wire, beam.bins, displaced)},
        {devices.catheter, catheter, wire_attenuation(catheter, beam.bins, displaced)}};
    const std::size_t seen = devices.catheter.empty() ? 1 : 2;
    for (const WirePixel& pixel :
         state.wire.cast(shifted(arm, exposure.vessel_shift), std::span(shadows).first(seen))) {
        const float amount = state.iodine.values[pixel.index];
        for (int k = 0; k < energy_bins; ++k) {
            const float arriving = primary[pixel.index][k] * fast_exp(per_iodine[k] * amount);
            expected.values[pixel.index] -= bare.scale * arriving * (1.0f - pixel.transmission[k]);
        }
    }
    return expected;
}

Field Fluoroscope::read(const CArm& arm, const SeenDevices& devices, const Exposure& exposure) {
    return read_out(expected_quanta(arm, devices, exposure), pixel_width(arm), state_->config.detector,
                    exposure.seed, exposure.frame, state_->threads);
}

const Display& Fluoroscope::display(const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    state_->move_to(arm);
    return *state_->bare_image(exposure).display;
}

GrayImage Fluoroscope::expose(const CArm& arm, const SeenDevices& devices, const Exposure& exposure) {
    const Field signal = read(arm, devices, exposure);
    return display(arm, exposure).show(signal);
}

void Fluoroscope::use_threads(int threads) {
    state_->threads = std::max(1, threads);
}

Field Fluoroscope::scatter_in(const Field& signal, const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    state_->move_to(arm);
    const BeamImages& at = state_->beam(exposure.kvp);
    Field open = state_->plane->flat;
    for (float& value : open.values) value *= static_cast<float>(at.gain);
    return estimated_scatter(signal, state_->plane->open, open, at.kvp, pixel_width(arm), arm.sid - arm.sod);
}

Field Fluoroscope::opening(const CArm& arm) const {
    return shutters(state_->config.display, arm);
}

Technique Fluoroscope::technique(const CArm& arm, const Exposure& exposure) {
    return state_->meter.technique(arm, exposure);
}

namespace {

std::vector<std::uint32_t> shadowed(WireImage& image, const CArm& arm, std::span<const Vec3> joints,
                                    const WireLook& look) {
    static const EnergyBins bins = fit_bins(detected_spectrum(74.0));
    static const Bins blood = bins.attenuation(Material::Blood);
    std::vector<std::uint32_t> pixels;
    for (const WirePixel& pixel : image.cast(arm, joints, look, wire_attenuation(look, bins, blood)))
        if (pixel.transmission[0] < 0.98f) pixels.push_back(pixel.index);
    std::sort(pixels.begin(), pixels.end());
    return pixels;
}

}  // namespace

std::vector<std::uint32_t> Fluoroscope::wire_pixels(const CArm& arm, const SeenDevices& devices,
                                                    const Vec3& shift) {
    require_usable(arm, {});
    const WireLook& look = devices.wire_look ? *devices.wire_look : state_->config.wire;
    return shadowed(state_->wire, shifted(arm, shift), devices.wire, look);
}

std::vector<std::uint32_t> Fluoroscope::catheter_pixels(const CArm& arm, const SeenDevices& devices,
                                                        const Vec3& shift) {
    require_usable(arm, {});
    return shadowed(state_->wire, shifted(arm, shift), devices.catheter, state_->config.catheter);
}

Fluoroscope::State::VesselView& Fluoroscope::State::view_of_vessels(const CArm& arm) {
    if (vessel_view && vessel_view->arm == arm) return *vessel_view;
    vessel_view = VesselView{arm, {}, {}};
    Field through(arm.pixels, arm.pixels);
    for (std::size_t layer = 0; layer < layers.size(); ++layer)
        if (layers[layer].takes_contrast) renderer.accumulate(static_cast<int>(layer), arm, through);
    for (std::uint32_t i = 0; i < through.values.size(); ++i)
        if (through.values[i] > 0.0f) vessel_view->pixels.push_back(i);
    return *vessel_view;
}

const std::vector<std::uint32_t>& Fluoroscope::vessel_pixels(const CArm& arm, const Vec3& shift) {
    require_usable(arm, {});
    return state_->view_of_vessels(shifted(arm, shift)).pixels;
}

DeepImage Fluoroscope::vessel_labels(const CArm& arm, const Vec3& shift,
                                     std::span<const std::uint16_t> of_node) {
    require_usable(arm, {});
    DeepImage image{arm.pixels, arm.pixels,
                    std::vector<std::uint16_t>(static_cast<std::size_t>(arm.pixels) * arm.pixels, 0)};
    if (!state_->vessels) return image;
    if (of_node.size() != state_->vessels->nodes().size())
        throw std::invalid_argument(std::to_string(of_node.size()) + " labels for " +
                                    std::to_string(state_->vessels->nodes().size()) + " nodes of vessels");
    const CArm seen = shifted(arm, shift);
    State::VesselView& view = state_->view_of_vessels(seen);
    if (!view.lengths) {
        const bool still = state_->pose && state_->pose->arm == seen;
        view.lengths = still && state_->pose->vessels ? *state_->pose->vessels : state_->vessels->at(seen);
    }
    const std::vector<std::uint16_t> labels = longest_label(*view.lengths, of_node);
    for (std::size_t row = 0; row < labels.size(); ++row)
        image.pixels[view.lengths->pixels[row]] = labels[row];
    return image;
}

std::vector<Fluoroscope::LayerLength> Fluoroscope::layer_lengths(const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    const PathLengthRenderer::Phase phase{exposure.breath, exposure.beat};
    std::vector<LayerLength> lengths;
    for (std::size_t layer = 0; layer < state_->layers.size(); ++layer) {
        const TissueLayer& tissue = state_->layers[layer];
        const CArm seen = tissue.takes_contrast ? shifted(arm, exposure.vessel_shift) : arm;
        lengths.push_back({tissue.name, tissue.material, tissue.inside,
                           state_->renderer.render(static_cast<int>(layer), seen, phase).length});
    }
    return lengths;
}

int Fluoroscope::unbalanced_pixels() const {
    return state_->pose ? state_->pose->unbalanced_pixels : 0;
}

}  // namespace render
