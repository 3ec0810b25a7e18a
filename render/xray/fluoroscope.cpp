#include "render/xray/fluoroscope.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "render/picture/fast_math.h"
#include "render/picture/filter.h"
#include "render/xray/beam_images.h"
#include "render/xray/contrast.h"
#include "render/xray/exposure_meter.h"
#include "render/xray/materials.h"
#include "render/xray/organ_phases.h"
#include "render/xray/path_length.h"
#include "render/xray/scatter.h"
#include "render/xray/wire_image.h"

namespace render {
namespace {

/// The lumen among the renderer's meshes, where devices have pushed it aside.
struct MovedVessels {
    PathLengthRenderer& renderer;
    const std::optional<LumenContrast>& lumen;
    const std::vector<Eigen::Vector3f>& moves;  // of the lumen's nodes; empty = none
    std::unique_lock<std::mutex> stay;          // while it lives nobody moves them
};

/// Keeps scratch memory and the vessels of the last view; the results depend on the arguments alone. `layers`
/// have the numbers of the renderer's meshes.
class ImageTruth {
public:
    /// Pixels where the device removes more than 2 % of the softest quanta, ascending.
    std::vector<std::uint32_t> device_pixels(const CArm&, const SeenDevice&, const WireLook&);
    /// Pixels whose ray runs through a layer that takes contrast, ascending.
    const std::vector<std::uint32_t>& vessel_pixels(const CArm&, MovedVessels&, std::span<const TissueLayer>);
    /// The label of the vessel that each ray runs through longest, by labels of the nodes; 0 = none. `known`:
    /// the lengths at that arm, null if they were not made before. Throws std::invalid_argument for another
    /// number of labels than nodes.
    DeepImage vessel_labels(const CArm&, MovedVessels&, std::span<const TissueLayer>,
                            const ContrastMatrix* known, std::span<const std::uint16_t> of_node);

private:
    struct VesselView {
        CArm arm;
        std::vector<Eigen::Vector3f> moves;
        std::vector<std::uint32_t> pixels;
        std::optional<ContrastMatrix> lengths;  // made when labels first need it
    };
    VesselView& view_of_vessels(const CArm&, MovedVessels&, std::span<const TissueLayer>);

    WireImage wire_;
    std::optional<VesselView> vessels_;
};

/// The arm as seen from shifted objects; shift [mm].
CArm seen_from_shifted(CArm arm, const Vec3& shift) {
    arm.isocentre -= shift;
    return arm;
}

std::vector<std::uint32_t> ImageTruth::device_pixels(const CArm& arm, const SeenDevice& device,
                                                     const WireLook& look) {
    static const EnergyBins bins = fit_bins(detected_spectrum(74.0));
    static const Bins blood = bins.attenuation(Material::Blood);
    std::vector<std::uint32_t> pixels;
    // A balloon is seen by what fills it; a catheter is where it is, whatever runs through it.
    const WireShadow shadow{device.joints,
                            look,
                            wire_attenuation(look, bins, blood),
                            device.radii.empty() ? nullptr : device.iodine,
                            device.radii,
                            device.straight};
    for (const WirePixel& pixel : wire_.cast(arm, {&shadow, 1}, bins.attenuation(Material::Iodine)))
        if (pixel.transmission[0] < 0.98f) pixels.push_back(pixel.index);
    std::sort(pixels.begin(), pixels.end());
    return pixels;
}

ImageTruth::VesselView& ImageTruth::view_of_vessels(const CArm& arm, MovedVessels& vessels,
                                                    std::span<const TissueLayer> layers) {
    if (vessels_ && vessels_->arm == arm && vessels_->moves == vessels.moves) return *vessels_;
    vessels_ = VesselView{arm, vessels.moves, {}, {}};
    Field through(arm.pixels, arm.pixels);
    for (std::size_t layer = 0; layer < layers.size(); ++layer)
        if (layers[layer].takes_contrast) vessels.renderer.accumulate(static_cast<int>(layer), arm, through);
    for (std::uint32_t i = 0; i < through.values.size(); ++i)
        if (through.values[i] > 0.0f) vessels_->pixels.push_back(i);
    return *vessels_;
}

const std::vector<std::uint32_t>& ImageTruth::vessel_pixels(const CArm& arm, MovedVessels& vessels,
                                                            std::span<const TissueLayer> layers) {
    return view_of_vessels(arm, vessels, layers).pixels;
}

DeepImage ImageTruth::vessel_labels(const CArm& arm, MovedVessels& vessels,
                                    std::span<const TissueLayer> layers, const ContrastMatrix* known,
                                    std::span<const std::uint16_t> of_node) {
    const LumenContrast& lumen = *vessels.lumen;
    if (of_node.size() != lumen.nodes().size())
        throw std::invalid_argument(std::to_string(of_node.size()) + " labels for " +
                                    std::to_string(lumen.nodes().size()) + " nodes of vessels");
    DeepImage image{arm.pixels, arm.pixels,
                    std::vector<std::uint16_t>(static_cast<std::size_t>(arm.pixels) * arm.pixels, 0)};
    VesselView& view = view_of_vessels(arm, vessels, layers);
    if (!view.lengths)
        view.lengths = !vessels.moves.empty() ? lumen.moved(vessels.moves).at(arm)
                       : known                ? *known
                                              : lumen.at(arm);
    const std::vector<std::uint16_t> labels = longest_label(*view.lengths, of_node);
    for (std::size_t row = 0; row < labels.size(); ++row)
        image.pixels[view.lengths->pixels[row]] = labels[row];
    return image;
}

/// The image with neither contrast nor wire at one dose.
struct BareImage {
    float scale = 0.0f;  // quanta per unit of BeamImages
    Field expected;      // with scatter [quanta]
    Technique technique;
    std::array<std::optional<Display>, 2> displays;  // by GreyCurve, as they are asked for
};

/// Whether images of the two differ only by rotation and by what lies in the isocentre.
bool same_plane(CArm a, const CArm& b) {
    a.lao = b.lao;
    a.cranial = b.cranial;
    a.isocentre = b.isocentre;
    return a == b;
}

void add_volumes(PoseImages& pose, std::span<const VolumeRayCaster> volumes) {
    for (const VolumeRayCaster& volume : volumes) {
        const std::vector<Field> lengths = volume.lengths(pose.arm);
        for (std::size_t p = 0; p < lengths.size(); ++p)
            add_length(pose.mixtures, volume.parts()[p].material, volume.parts()[p].inside, lengths[p]);
    }
}

/// What lies around vessels and devices while the stand moves, at one moment of breath and heartbeat.
struct CoarsePose {
    PoseImages images;
    int factor = 1;  // of fewer pixels on a side
    MoverFractions moment{};
};

/// How many times fewer rays on a side are cast while the stand moves: about 256 remain.
int coarser_by(int pixels) {
    const int factor = (pixels + 128) / 256;
    return factor > 1 && pixels % factor == 0 ? factor : 1;
}

std::vector<VolumeRayCaster> ray_casters_of(std::vector<DensityVolume> volumes) {
    std::vector<VolumeRayCaster> ray_casters;
    for (DensityVolume& volume : volumes) ray_casters.emplace_back(std::move(volume));
    return ray_casters;
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
    if (!(exposure.breath >= 0.0 && exposure.breath <= largest_breath))
        found.emplace_back("the share of breath must lie within 0 and " +
                           std::to_string(static_cast<int>(largest_breath)));
    for (const double fraction : {exposure.beat, exposure.drift})
        if (!(fraction >= 0.0 && fraction <= 1.0))
            found.emplace_back("the shares of heartbeat and drift must lie within 0 and 1");
    return found;
}

/// What copies share.
struct Fluoroscope::Patient {
    std::vector<TissueLayer> layers;  // their meshes have been moved to the renderer
    PathLengthRenderer renderer;
    std::optional<LumenContrast> vessels;
    std::optional<DistalVessels> distal;
    std::vector<VolumeRayCaster> volumes;
    /// Poses that some copy has drawn, the last one first, and no more than some bytes of them.
    std::optional<PoseImages> drawn(const CArm&);
    void keep(const PoseImages&);
    std::mutex posing;
    std::list<PoseImages> poses;
    std::mutex moving;
    std::vector<Eigen::Vector3f> moves;  // of the vessels' nodes, as the renderer has them; empty = none
};

std::optional<PoseImages> Fluoroscope::Patient::drawn(const CArm& arm) {
    const std::lock_guard lock(posing);
    const auto known =
        std::ranges::find_if(poses, [&](const PoseImages& pose) { return same_pose(pose.arm, arm); });
    if (known == poses.end()) return {};
    poses.splice(poses.begin(), poses, known);
    PoseImages copy = poses.front();
    copy.arm = arm;
    return copy;
}

void Fluoroscope::Patient::keep(const PoseImages& pose) {
    constexpr std::size_t most = 64'000'000;  // bytes
    const auto bytes = [](const PoseImages& of) {
        return of.mixtures.size() * 2 * sizeof(float) * static_cast<std::size_t>(of.arm.pixels) *
               static_cast<std::size_t>(of.arm.pixels);
    };
    const std::lock_guard lock(posing);
    poses.push_front(pose);
    std::size_t all = 0;
    const auto last =
        std::ranges::find_if(poses, [&](const PoseImages& of) { return (all += bytes(of)) > most; });
    poses.erase(last, poses.end());
}

struct Fluoroscope::State {
    FluoroscopeConfig config;
    ExposureMeter meter;
    std::shared_ptr<Patient> patient;
    std::vector<TissueLayer>& layers = patient->layers;
    PathLengthRenderer& renderer = patient->renderer;
    std::optional<LumenContrast>& vessels = patient->vessels;
    std::optional<DistalVessels>& distal = patient->distal;
    std::vector<VolumeRayCaster>& volumes = patient->volumes;
    std::vector<VertexMove> lumen_moves;  // that the pose's vessels were made with
    WireImage wire;
    std::optional<PlaneImages> plane, coarse_plane;
    std::optional<PoseImages> pose;
    std::optional<CoarsePose> coarse;  // of the pose while the stand moves; its mixtures are here alone
    // Of the pose, by requested voltage, 0 = automatic, and focal spot; by those and dose.
    std::map<std::pair<double, double>, BeamImages> beams;
    std::map<std::tuple<double, double, double>, BareImage> bare;
    OrganPhases phases;  // of the pose
    bool still = false;  // it knows the pose alone
    ImageTruth truth;
    Field iodine;                              // scratch: iodine in the beam [mg/ml·mm]
    std::vector<std::uint32_t> iodine_pixels;  // pixels where that is not 0

    State(const FluoroscopeConfig& chosen, std::span<const TissueLayer> around,
          std::vector<VolumeRayCaster> through, std::shared_ptr<const MeteredLayers> known)
        : config(chosen),
          meter(chosen, around.subspan(known ? known->count() : 0), through, known),
          patient(std::make_shared<Patient>()),
          phases(around) {
        volumes = std::move(through);
    }
    State(const FluoroscopeConfig& chosen, StillView view)
        : config(chosen),
          meter(chosen, view.arm, std::move(view.metered)),
          patient(std::make_shared<Patient>()),
          plane(plane_images(chosen, view.arm)),
          pose(PoseImages()),
          phases({}),
          still(true) {
        pose->arm = view.arm;
        pose->mixtures = std::move(view.seen);
    }
    State(const State& like)
        : config(like.config),
          meter(like.meter),
          patient(like.patient),
          phases(like.phases),
          still(like.still) {
        phases.clear();
        if (still) plane = like.plane, pose = like.pose;
    }
    State& operator=(const State&) = delete;

    void move_to(const CArm&, const Exposure&);
    MovedVessels move_vessels(std::span<const Eigen::Vector3f> of_nodes);
    const BeamImages& beam(const Exposure&);
    BareImage& bare_image(const Exposure&);
    const Display& display(const Exposure&);
    PosedLayers posed() { return {renderer, layers, *pose}; }
    void dissolve_in_organ(const OrganIodine&, const OrganMoment&);
    void dissolve(const Exposure&, const OrganMoment&);
    void dissolve_in_vessels(const Exposure&);
    void dissolve_in_distal(const Exposure&);
    void dissolve_in(const SparseLength&, float concentration);
    void blur_iodine(const Eigen::Matrix2d& covariance);
    std::vector<float> blurred;  // scratch of blur_iodine
};

/// Moves the layers that take contrast with the nodes. Without nodes they stay.
MovedVessels Fluoroscope::State::move_vessels(std::span<const Eigen::Vector3f> of_nodes) {
    std::vector<Eigen::Vector3f>& moves = patient->moves;
    std::unique_lock stay(patient->moving);
    if (!vessels || std::equal(of_nodes.begin(), of_nodes.end(), moves.begin(), moves.end()))
        return {renderer, vessels, moves, std::move(stay)};
    moves.assign(of_nodes.begin(), of_nodes.end());
    const std::vector<Eigen::Vector3f> still(vessels->nodes().size(), Eigen::Vector3f::Zero());
    geometry::TriangleMesh lumen = vessels->mesh();
    lumen.vertices = vessels->moved_vertices(moves.empty() ? still : moves);
    for (std::size_t layer = 0; layer < layers.size(); ++layer)
        if (layers[layer].takes_contrast) renderer.move(static_cast<int>(layer), lumen);
    return {renderer, vessels, moves, std::move(stay)};
}

void Fluoroscope::State::move_to(const CArm& arm, const Exposure& exposure) {
    if (still && !(pose->arm == arm))
        throw std::invalid_argument("expected the arm of the still view, found another");
    const int factor = exposure.stand_moves && vessels ? coarser_by(arm.pixels) : 1;
    const MoverFractions moment = {exposure.breath, exposure.beat, exposure.drift};
    const bool same_beam = pose && pose->arm == arm;
    if (!same_beam) {
        beams.clear();
        bare.clear();
        phases.beam_changes();
        if (!plane || !same_plane(plane->arm, arm)) plane = plane_images(config, arm);
    }
    // Collimator and filters leave the lengths as they are.
    if (pose && same_pose(pose->arm, arm) && (factor == 1 ? !coarse : coarse && coarse->moment == moment)) {
        pose->arm = arm;
        if (coarse && !same_beam) {
            CArm& few = coarse->images.arm;
            const int pixels = few.pixels;
            few = arm;
            few.pixels = pixels;
            coarse_plane = plane_images(config, few);
        }
        return;
    }
    beams.clear();
    bare.clear();
    phases.clear();
    coarse.reset();
    if (factor == 1) {
        pose = patient->drawn(arm);
        if (pose) return;
        {
            const MovedVessels at_rest = move_vessels({});
            pose = pose_images(renderer, layers, vessels.has_value(), arm);
        }
        add_volumes(*pose, volumes);
        if (patient.use_count() > 1) patient->keep(*pose);
        return;
    }
    if (!pose || !(pose->arm == arm)) {
        pose.emplace();
        pose->arm = arm;
    }
    pose->mixtures.clear();
    pose->organs.clear();
    CArm few = arm;
    few.pixels /= factor;
    if (!coarse_plane || !same_plane(coarse_plane->arm, few)) coarse_plane = plane_images(config, few);
    coarse.emplace();
    coarse->factor = factor;
    coarse->moment = moment;
    coarse->images.arm = few;
    coarse->images.mixtures = meter.lengths(few, layers, moment);
}

const BeamImages& Fluoroscope::State::beam(const Exposure& exposure) {
    const auto [place, is_new] = beams.try_emplace({exposure.kvp.value_or(0.0), exposure.focal_spot});
    if (!is_new) return place->second;
    const double voltage = meter.voltage(pose->arm, exposure.kvp);
    Field scatter = meter.scatter(pose->arm, voltage);
    if (!coarse)
        return place->second = beam_images(*plane, *pose, voltage, exposure.focal_spot, std::move(scatter));
    const PoseImages& few = coarse->images;
    const BeamImages of_few =
        beam_images(*coarse_plane, few, voltage, exposure.focal_spot,
                    stretched(scatter, static_cast<double>(coarse->factor), few.arm.pixels));
    BeamImages& made = place->second = enlarged(of_few, coarse->factor, *plane, std::move(scatter));
    // Exposure is measured at rest, not at the moment of breath and heartbeat.
    double flat = 0.0, disc = 0.0;
    for (std::size_t i = 0; i < plane->flat.values.size(); ++i) {
        const float here = plane->measured.values[i] * plane->open.values[i];
        flat += static_cast<double>(here) * plane->flat.values[i];
        disc += here;
    }
    const double passes = meter.measured(pose->arm, voltage), width = pixel_width(pose->arm);
    if (disc > 0.0 && passes > 0.0)
        made.gain = quanta_per_dose_and_area * width * width / (passes * flat / disc);
    return made;
}

BareImage& Fluoroscope::State::bare_image(const Exposure& exposure) {
    const auto [place, is_new] =
        bare.try_emplace({exposure.kvp.value_or(0.0), exposure.focal_spot, exposure.detector_dose});
    BareImage& result = place->second;
    if (!is_new) return result;

    const CArm& arm = pose->arm;
    const BeamImages& at = beam(exposure);
    result.technique = meter.technique(arm, exposure);
    result.scale = static_cast<float>(at.gain * exposure.detector_dose * result.technique.delivered);
    result.expected = Field(arm.pixels, arm.pixels);
    for (std::size_t i = 0; i < result.expected.values.size(); ++i)
        result.expected.values[i] = result.scale * (sum(at.primary[i]) + at.scatter.values[i]);
    return result;
}

const Display& Fluoroscope::State::display(const Exposure& exposure) {
    BareImage& bare = bare_image(exposure);
    std::optional<Display>& display = bare.displays[static_cast<std::size_t>(exposure.curve)];
    // Adjusted to the image without contrast.
    if (!display)
        display.emplace(exposure.curve == GreyCurve::Cine ? config.cine : config.display, bare.expected,
                        plane->flat, beam(exposure).weights, plane->open);
    return *display;
}

void Fluoroscope::State::dissolve_in_organ(const OrganIodine& organ, const OrganMoment& organs) {
    if (!(organ.iodine > 0.0)) return;
    auto found = pose->organs.find(organ.layer);
    if (coarse && found == pose->organs.end() && organ.layer >= 0 &&
        organ.layer < static_cast<int>(layers.size())) {
        const auto& [breath, beat, drift] = coarse->moment;
        found =
            pose->organs
                .emplace(organ.layer,
                         SparseLength(renderer.render(organ.layer, pose->arm, {breath, beat, drift}).length))
                .first;
    }
    if (found == pose->organs.end()) return;
    const auto concentration = static_cast<float>(organ.iodine);
    if (!organs.dissolve_in(organ.layer, concentration, iodine, iodine_pixels))
        dissolve_in(found->second, concentration);
}

/// Writes the iodine in the beam to `iodine`, and the pixels that have any to `iodine_pixels`.
void Fluoroscope::State::dissolve(const Exposure& exposure, const OrganMoment& organs) {
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
    for (const OrganIodine& organ : exposure.organs) dissolve_in_organ(organ, organs);
    add_clouds(pose->arm, exposure.clouds, iodine, iodine_pixels);
    add_clouds(pose->arm, exposure.jets, iodine, iodine_pixels);
}

namespace {

/// Nodes where shift and moves, none or one a node, have brought them [mm].
std::vector<Vec3> displaced(std::span<const Vec3> nodes, const Vec3& shift,
                            std::span<const Eigen::Vector3f> moves) {
    std::vector<Vec3> places(nodes.begin(), nodes.end());
    for (std::size_t n = 0; n < places.size(); ++n) {
        places[n] += shift;
        if (n < moves.size()) places[n] += moves[n].cast<double>();
    }
    return places;
}

}  // namespace

/// What lies at pixels with iodine goes to their neighbours by the kernel, so that none is lost.
void Fluoroscope::State::blur_iodine(const Eigen::Matrix2d& covariance) {
    constexpr double visible = 0.01;  // [pixels²]
    if (covariance.trace() < visible || iodine_pixels.empty()) return;
    const SmallBlur kernel(covariance);
    const int width = iodine.width;
    const std::size_t count = iodine_pixels.size();
    blurred.clear();
    for (const std::uint32_t pixel : iodine_pixels) blurred.push_back(iodine.values[pixel]);
    const auto add = [&](std::uint32_t pixel, float amount) {
        float& there = iodine.values[pixel];
        if (there == 0.0f) iodine_pixels.push_back(pixel);
        there += amount;
    };
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t pixel = iodine_pixels[i];
        const int column = static_cast<int>(pixel) % width, row = static_cast<int>(pixel) / width;
        if (column == 0 || row == 0 || column + 1 == width || row + 1 == iodine.height) continue;
        const float there = blurred[i];
        iodine.values[pixel] += (kernel.middle - 1) * there;
        add(pixel - 1, kernel.across * there);
        add(pixel + 1, kernel.across * there);
        add(pixel - width, kernel.down * there);
        add(pixel + width, kernel.down * there);
        if (kernel.falling == 0.0f) continue;
        add(pixel - width - 1, kernel.falling * there);
        add(pixel + width + 1, kernel.falling * there);
        add(pixel - width + 1, -kernel.falling * there);
        add(pixel + width - 1, -kernel.falling * there);
    }
}

void Fluoroscope::State::dissolve_in_distal(const Exposure& exposure) {
    const std::vector<float>& there = exposure.distal_iodine;
    if (std::none_of(there.begin(), there.end(), [](float c) { return c > 1e-3f; })) return;
    if (!pose->distal) pose->distal = distal->at(pose->arm);
    std::vector<PixelShift> shifts;
    if (!exposure.vessel_shift.isZero() || !exposure.distal_moves.empty())
        shifts = pixel_shifts(pose->arm, pose->distal->middle,
                              displaced(pose->distal->middle, exposure.vessel_shift, exposure.distal_moves));
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
    if (!pose->vessels || lumen_moves != exposure.lumen_moves) {
        lumen_moves = exposure.lumen_moves;
        pose->vessels =
            lumen_moves.empty() ? vessels->at(pose->arm) : vessels->reshaped(lumen_moves).at(pose->arm);
    }
    const std::span<const Vec3> nodes = vessels->nodes();
    std::vector<float> concentration(nodes.size(), static_cast<float>(exposure.iodine));
    for (std::size_t i = 0; i < std::min(nodes.size(), exposure.vessel_iodine.size()); ++i)
        concentration[i] += exposure.vessel_iodine[i];
    std::vector<Eigen::Vector3f> streams = exposure.vessel_streams;
    if (!streams.empty()) streams.resize(nodes.size(), Eigen::Vector3f::Zero());
    if (exposure.vessel_shift.isZero() && exposure.vessel_moves.empty()) {
        iodine_thickness(*pose->vessels, concentration, iodine, streams);
        for (const std::uint32_t i : pose->vessels->pixels)
            if (iodine.values[i] > 0.0f) iodine_pixels.push_back(i);
        return;
    }
    const std::vector<Vec3> places = displaced(nodes, exposure.vessel_shift, exposure.vessel_moves);
    iodine_thickness(*pose->vessels, concentration, pixel_shifts(pose->arm, nodes, places), iodine, streams);
    for (std::uint32_t i = 0; i < iodine.values.size(); ++i)
        if (iodine.values[i] > 0.0f) iodine_pixels.push_back(i);
}

Fluoroscope::Fluoroscope(FluoroscopeConfig config, std::vector<TissueLayer> layers,
                         std::optional<LumenContrast> vessels, std::optional<DistalVessels> distal,
                         std::vector<DensityVolume> volumes, std::shared_ptr<const MeteredLayers> known)
    : state_(std::make_unique<State>(config, layers, ray_casters_of(std::move(volumes)), std::move(known))) {
    state_->vessels = std::move(vessels);
    state_->distal = std::move(distal);

    for (TissueLayer& layer : layers) {
        if (!layer.closed) require_closed(layer.name, layer.mesh);
        if (layer.takes_contrast) require_simple(layer.name, layer.mesh);
        state_->renderer.add(layer.mesh, layer.breath, layer.beat, layer.drift);
        layer.mesh = {};
    }
    state_->layers = std::move(layers);
}

Fluoroscope::Fluoroscope(std::unique_ptr<State> state) : state_(std::move(state)) {}
Fluoroscope Fluoroscope::of_view(FluoroscopeConfig config, StillView view) {
    return Fluoroscope(std::make_unique<State>(config, std::move(view)));
}
Fluoroscope::Fluoroscope(const Fluoroscope& like) : state_(std::make_unique<State>(*like.state_)) {}
Fluoroscope::~Fluoroscope() = default;
Fluoroscope::Fluoroscope(Fluoroscope&&) noexcept = default;
Fluoroscope& Fluoroscope::operator=(Fluoroscope&&) noexcept = default;

namespace {

/// The quanta where organs move.
void move_organs_in(Field& expected, const OrganMoment& organs, const BeamImages& beam, float scale) {
    const auto width = static_cast<std::size_t>(expected.width);
    std::vector<FourBins> passing(width);
    for (int row = 0; row < expected.height; ++row) {
        std::fill(passing.begin(), passing.end(), FourBins{} + 1.0f);
        const auto [first, end] = organs.dim_row(row, passing);
        const std::size_t start = static_cast<std::size_t>(row) * width;
        const PixelBins* const still = organs.still().data() + start;
        const float* const scatter = beam.scatter.values.data() + start;
        float* const quanta = expected.values.data() + start;
        for (int i = first; i < end; ++i) {
            float passed = 0.0f;
            for (int k = 0; k < energy_bins; ++k) passed += still[i][k] * passing[i][k];
            quanta[i] = scale * (passed + scatter[i]);
        }
    }
}

}  // namespace

Field Fluoroscope::expected_quanta(const CArm& arm, const SeenDevices& devices, const Exposure& exposure) {
    require_usable(arm, exposure);
    State& state = *state_;
    state.move_to(arm, exposure);
    const BareImage& bare = state.bare_image(exposure);
    const BeamImages& beam = state.beam(exposure);
    Field expected = bare.expected;
    const OrganMoment organs =
        state.coarse ? OrganMoment() : state.phases.moment(exposure, beam, state.posed());
    if (!organs.at_rest()) move_organs_in(expected, organs, beam, bare.scale);
    const std::vector<PixelBins>& primary = organs.at_rest() ? beam.primary : organs.still();

    state.dissolve(exposure, organs);
    Unsharpness unsharp{exposure.focal_spot, Eigen::Vector2d::Zero()};
    if (!exposure.vessel_velocity.isZero()) {
        const Vec3 way = 1e-3 * bare.technique.pulse_width * exposure.vessel_velocity;
        const Pixel from = project(arm, arm.isocentre), to = project(arm, arm.isocentre + way);
        constexpr double most = 2;  // of what one pulse blurs [pixels]
        unsharp.motion = Eigen::Vector2d(to.x - from.x, to.y - from.y);
        unsharp.motion *= std::min(1.0, most / std::max(1e-9, unsharp.motion.norm()));
    }
    state.blur_iodine(focal_blur(arm, exposure.focal_spot, arm.sod) +
                      unsharp.motion * unsharp.motion.transpose() / 12);
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
        organs.dim(pixels, arm.pixels, transmission);
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            float passed = beam.scatter.values[pixels[i]];
            for (int k = 0; k < energy_bins; ++k)
                passed += primary[pixels[i]][k] * transmission[i * energy_bins + k];
            expected.values[pixels[i]] = bare.scale * passed;
        }
    }

    // Devices displace blood and what is dissolved in it; they are assumed to lie in a vessel over their
    // whole length.
    const Bins blood = beam.bins.attenuation(Material::Blood);
    std::vector<WireShadow> shadows;
    std::vector<DeviceIodine> iodine(devices.all.size());
    for (std::size_t d = 0; d < devices.all.size(); ++d) {
        const SeenDevice& device = devices.all[d];
        if (device.joints.empty()) continue;
        if (device.iodine) iodine[d] = *device.iodine;
        iodine[d].around += exposure.iodine;
        Bins displaced = blood;
        for (int k = 0; k < energy_bins; ++k) displaced[k] += iodine[d].around * per_concentration[k];
        const WireLook& look = device.look ? *device.look : state.config.wire;
        shadows.push_back({device.joints, look, wire_attenuation(look, beam.bins, displaced), &iodine[d],
                           device.radii, device.straight});
    }
    for (const WirePixel& pixel : state.wire.cast(seen_from_shifted(arm, exposure.vessel_shift), shadows,
                                                  per_concentration, unsharp)) {
        const float amount = state.iodine.values[pixel.index];
        PixelBins before;
        for (int k = 0; k < energy_bins; ++k) before[k] = fast_exp(per_iodine[k] * amount);
        organs.dim({&pixel.index, 1}, arm.pixels, before);
        for (int k = 0; k < energy_bins; ++k) {
            const float arriving = primary[pixel.index][k] * before[k];
            expected.values[pixel.index] -= bare.scale * arriving * (1.0f - pixel.transmission[k]);
        }
    }
    return expected;
}

Field Fluoroscope::read(const CArm& arm, const SeenDevices& devices, const Exposure& exposure) {
    return read_out(expected_quanta(arm, devices, exposure), pixel_width(arm), state_->config.detector,
                    exposure.seed, exposure.frame);
}

const Display& Fluoroscope::display(const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    state_->move_to(arm, exposure);
    return state_->display(exposure);
}

GrayImage Fluoroscope::expose(const CArm& arm, const SeenDevices& devices, const Exposure& exposure) {
    const Field signal = read(arm, devices, exposure);
    return display(arm, exposure).show(signal);
}

bool Fluoroscope::draw_ahead(const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    return state_->pose && state_->pose->arm == arm && !state_->coarse &&
           state_->phases.draw_ahead(exposure, state_->beam(exposure), state_->posed());
}

Field Fluoroscope::scatter_in(const Field& signal, const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    state_->move_to(arm, exposure);
    const BeamImages& at = state_->beam(exposure);
    Field open = state_->plane->flat;
    const Bins of_copper = at.bins.attenuation(Material::Copper);
    for (std::size_t i = 0; i < open.values.size(); ++i) {
        float passes = static_cast<float>(at.gain);
        if (const Field& copper = state_->plane->copper; !copper.values.empty()) {
            PixelBins bins = filter_transmission(copper.values[i], of_copper);
            for (int k = 0; k < energy_bins; ++k) bins[k] *= static_cast<float>(at.bins.weights[k]);
            passes *= sum(bins);
        }
        open.values[i] *= passes;
    }
    return estimated_scatter(signal, state_->plane->open, open, at.kvp, pixel_width(arm), arm.sid - arm.sod);
}

StillView Fluoroscope::still_view(const CArm& arm) {
    require_usable(arm, {});
    state_->move_to(arm, {});
    return {arm, state_->pose->mixtures, state_->meter.lengths_at(arm)};
}

Field Fluoroscope::opening(const CArm& arm) const {
    return shutters(state_->config.display, arm);
}

Field Fluoroscope::measuring_field(const CArm& arm) const {
    Field field = measuring_disc(arm, state_->config.measuring_radius * arm.detector_width);
    const Field open = opening(arm);
    for (std::size_t i = 0; i < field.values.size(); ++i)
        if (open.values[i] < 0.5f) field.values[i] = 0.0f;
    return field;
}

Technique Fluoroscope::technique(const CArm& arm, const Exposure& exposure) {
    return state_->meter.technique(arm, exposure);
}

std::vector<std::uint32_t> Fluoroscope::device_pixels(const CArm& arm, const SeenDevice& device,
                                                      const Vec3& shift) {
    require_usable(arm, {});
    const WireLook& look = device.look ? *device.look : state_->config.wire;
    return state_->truth.device_pixels(seen_from_shifted(arm, shift), device, look);
}

const std::vector<std::uint32_t>& Fluoroscope::vessel_pixels(const CArm& arm, const Vec3& shift,
                                                             std::span<const Eigen::Vector3f> moves) {
    require_usable(arm, {});
    MovedVessels vessels = state_->move_vessels(moves);
    return state_->truth.vessel_pixels(seen_from_shifted(arm, shift), vessels, state_->layers);
}

DeepImage Fluoroscope::vessel_labels(const CArm& arm, const Vec3& shift,
                                     std::span<const std::uint16_t> of_node,
                                     std::span<const Eigen::Vector3f> moves) {
    require_usable(arm, {});
    if (!state_->vessels)
        return {arm.pixels, arm.pixels,
                std::vector<std::uint16_t>(static_cast<std::size_t>(arm.pixels) * arm.pixels, 0)};
    const CArm seen = seen_from_shifted(arm, shift);
    const bool posed = state_->pose && state_->pose->arm == seen && state_->pose->vessels;
    MovedVessels vessels = state_->move_vessels(moves);
    return state_->truth.vessel_labels(seen, vessels, state_->layers,
                                       posed ? &*state_->pose->vessels : nullptr, of_node);
}

std::vector<Fluoroscope::LayerLength> Fluoroscope::layer_lengths(const CArm& arm, const Exposure& exposure) {
    require_usable(arm, exposure);
    const PathLengthRenderer::Phase phase{exposure.breath, exposure.beat, exposure.drift};
    const MovedVessels vessels = state_->move_vessels(exposure.vessel_moves);
    std::vector<LayerLength> lengths;
    for (std::size_t layer = 0; layer < state_->layers.size(); ++layer) {
        const TissueLayer& tissue = state_->layers[layer];
        const CArm seen = tissue.takes_contrast ? seen_from_shifted(arm, exposure.vessel_shift) : arm;
        lengths.push_back({tissue.name, tissue.material, tissue.inside,
                           state_->renderer.render(static_cast<int>(layer), seen, phase).length});
        if (!tissue.texture_blobs.empty()) add_lengths(tissue.texture_blobs, seen, lengths.back().length);
    }
    return lengths;
}

}  // namespace render
