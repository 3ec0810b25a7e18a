#pragma once
/// The imaging chain: from anatomy, devices and exposure to a frame.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"
#include "render/xray/contrast.h"
#include "render/xray/detector.h"
#include "render/xray/display.h"
#include "render/xray/distal_vessels.h"
#include "render/xray/iodine_clouds.h"
#include "render/xray/materials.h"
#include "render/xray/texture_blobs.h"
#include "render/xray/volume.h"
#include "render/xray/wire_image.h"
#include "render/xray/x_ray_tube.h"

namespace render {

/// A closed solid of one material inside another. Within it, μ changes from that of `inside` to that of
/// `material`, so nested solids are listed with what surrounds each (a trabecular core inside cortical bone
/// inside soft tissue). Solids at the same level of nesting should not overlap: there the change counts
/// twice.
struct TissueLayer {
    std::string name;
    Material material = Material::SoftTissue;
    Material inside = Material::Air;
    geometry::TriangleMesh mesh;  // closed [mm]
    bool takes_contrast = false;  // a lumen: Exposure::iodine is dissolved in it
    bool perfused = false;        // an organ: Exposure::organs may name it
    /// Displacement of each vertex at full inspiration, at the end of systole, and when the bowel has carried
    /// its gas farthest [mm]; empty = still.
    std::vector<Eigen::Vector3f> breath = {}, beat = {}, drift = {};
    /// Where its fraction differs from that of the mesh: texture, which neither breath nor heartbeat moves.
    std::vector<TextureBlob> texture_blobs = {};
    bool closed = false;  // the mesh has been found to be so, and need not be looked at again
};

/// Path lengths through all layers that change μ in the same way.
struct Mixture {
    Material material, inside;
    Field length;       // [mm]
    Field before = {};  // of it what is nearer to the source than the isocentre; empty: half [mm]

    void state(geometry::StateStream& s) { s(material, inside, length, before); }
};

/// All that frames from one arm need of a patient at rest, without contrast.
struct StillView {
    CArm arm;
    std::vector<Mixture> seen;     // on each pixel
    std::vector<Mixture> metered;  // by the rays of automatic exposure

    void state(geometry::StateStream& s) { s(arm, seen, metered); }
};

/// What displaces the vertices of layers.
enum Mover { Breath, Beat, Drift };
inline constexpr int movers = 3;
/// Of each mover the fraction of its displacements, 0 to 1.
using MoverFractions = std::array<double, movers>;

struct FluoroscopeConfig {
    WireLook wire;  // of a SeenDevice without a look of its own
    DetectorSpec detector;
    DisplaySpec display;
    DisplaySpec cine = cine_display;
    double scatter = 1.0;            // times what scatter_field gives [-]
    double measuring_radius = 0.30;  // of the disc where exposure is measured, in image widths [-]
    double heel = 0.08;              // loss of intensity at the edge toward the anode (the head) [-]
};

/// Iodine in an organ's small vessels.
struct OrganIodine {
    int layer = 0;        // index of a perfused layer
    double iodine = 0.0;  // mean over the organ [mg/ml]

    void state(geometry::StateStream& s) { s(layer, iodine); }
};

/// Of a pulse [nGy].
inline constexpr double largest_detector_dose = 1e5;
/// Of the displacements by a quiet breath, in a deep one and a cough [-].
inline constexpr double largest_breath = 4;

/// One pulse.
struct Exposure {
    std::uint64_t frame = 0;
    std::uint64_t seed = 0;
    double detector_dose = 30.0;     // mean over the measuring field, per pulse [nGy]
    std::optional<double> kvp = {};  // tube voltage [kV]; empty = automatic
    double iodine = 0.0;             // concentration throughout the layers that take contrast [mg/ml]
    /// In addition, at each node of the vessels [mg/ml]; empty = none.
    std::vector<float> vessel_iodine = {};
    /// How unevenly that lies in each node's piece: see iodine_thickness; empty = well mixed.
    std::vector<Eigen::Vector3f> vessel_streams = {};
    /// At each node of the distal arteries [mg/ml]; empty = none.
    std::vector<float> distal_iodine = {};
    std::vector<OrganIodine> organs = {};
    std::vector<IodineCloud> clouds = {};  // in the tissue, where shift and moves have brought them
    std::vector<IodineCloud> jets = {};    // in the blood, beside what the vessels' nodes have
    /// Displacement of vessels and wire from where meshes and joints place them: a beating heart [mm].
    geometry::Vec3 vessel_shift = geometry::Vec3::Zero();
    /// Displacement of the vessels besides, as devices push them aside: of each node of the vessels, and of
    /// each node of the distal arteries; empty = none [mm].
    std::vector<Eigen::Vector3f> vessel_moves = {}, distal_moves = {};
    /// Of the lumen's vertices besides, where a vessel is narrower than its mesh; contrast alone shows it.
    std::vector<VertexMove> lumen_moves = {};
    /// Fraction of their displacements that the layers have: 0 to `largest_breath`, 0 to 1, 0 to 1.
    double breath = 0.0, beat = 0.0, drift = 0.0;
    GreyCurve curve = GreyCurve::Fluoroscopy;  // of the image
    double focal_spot = 0.6;                   // side of the tube's [mm]
    /// Of vessels and wire in the room: they are blurred by their way within the pulse [mm/s].
    geometry::Vec3 vessel_velocity = geometry::Vec3::Zero();
    /// Whether C-arm or table move: what lies around vessels and devices is then drawn with fewer rays, so
    /// that a new pose in every pulse takes no longer than the pulses are apart.
    bool stand_moves = false;

    void state(geometry::StateStream& s) {
        s(frame, seed, detector_dose, kvp, iodine, vessel_iodine, distal_iodine, organs, vessel_shift,
          vessel_moves, distal_moves, vessel_streams, breath, beat, drift, clouds, curve, focal_spot,
          vessel_velocity, stand_moves);
        s.unless_empty(lumen_moves);
        s.unless_empty(jets);
    }
};

/// Everything wrong with an exposure; empty when it is usable.
std::vector<std::string> problems(const Exposure&);

class MeteredLayers;

/// Keeps the GL context, the meshes, and the images that depend on the pose of the C-arm alone. A frame
/// depends on the arguments of `expose` and never on the frames before it. To be used by one thread at a
/// time; copies, which share context and meshes, may be used by others.
class Fluoroscope {
public:
    /// Throws OpenMeshError for an open mesh, OverlappingMeshError for a lumen that overlaps itself, and
    /// std::runtime_error for a broken one or when GL fails. With `vessels`, the nodes of the layers that
    /// take contrast, iodine may vary from place to place; `distal` arteries show nothing but their iodine.
    /// `volumes` are in the beam besides the layers; `known`: what exposure
    /// meters need of the first layers, where that is made already.
    Fluoroscope(FluoroscopeConfig, std::vector<TissueLayer>, std::optional<LumenContrast> vessels = {},
                std::optional<DistalVessels> distal = {}, std::vector<DensityVolume> volumes = {},
                std::shared_ptr<const MeteredLayers> known = {});
    /// Of what still_view() of another one has given, without OpenGL: from that arm its frames of a patient
    /// at rest without contrast are the other one's, to the bit. From any other it throws
    /// std::invalid_argument.
    static Fluoroscope of_view(FluoroscopeConfig, StillView);
    ~Fluoroscope();
    /// Of the same patient, with images of its own.
    Fluoroscope(const Fluoroscope&);
    Fluoroscope(Fluoroscope&&) noexcept;
    Fluoroscope& operator=(Fluoroscope&&) noexcept;

    /// The signal of one pulse as read out, with its noise [quanta], arm.pixels squared. A device with
    /// fewer than two joints, or with one that is not finite, is left out.
    /// The tube output follows the anatomy (automatic exposure, see MeasuringField): before wire and
    /// contrast, the mean dose behind the patient in a disc in the middle of the image is `detector_dose` at
    /// any pose for which the tube is strong enough.
    /// Throws std::invalid_argument with all the problems of arm or exposure.
    Field read(const CArm&, const SeenDevices&, const Exposure&);

    /// The quanta expected on each pixel, before noise: the means that `read` draws its numbers around.
    Field expected_quanta(const CArm&, const SeenDevices&, const Exposure&);

    /// The display for signals that were read at this pose, dose and curve. Valid until the next call of a
    /// member that takes an arm.
    const Display& display(const CArm&, const Exposure&);

    /// A live frame: the signal of the pulse, displayed.
    GrayImage expose(const CArm&, const SeenDevices&, const Exposure&);

    /// Estimate of the scatter in a measured signal, both per nGy, by the signal itself and by that of the
    /// open beam at the same exposure: see estimated_scatter.
    Field scatter_in(const Field& signal, const CArm&, const Exposure&);

    /// Draws a part, some milliseconds' worth, of what frames after this exposure will need as breath and
    /// heartbeat go on; false when all of it is there, or the last pose was another. To be called while there
    /// is time: frames are the same with and without.
    bool draw_ahead(const CArm&, const Exposure&);

    StillView still_view(const CArm&);

    /// Transmission of the collimator [-].
    Field opening(const CArm&) const;

    /// 1 where the measuring field lies that the collimator leaves open, 0 outside [-].
    Field measuring_field(const CArm&) const;

    /// The output of the tube and the dose to the patient for the pulse.
    Technique technique(const CArm&, const Exposure&);

    /// Ground truth: pixels where the device removes more than 2 % of the softest quanta, and pixels whose
    /// ray runs through a layer that takes contrast; in ascending order. `shift`: Exposure::vessel_shift,
    /// `moves`: its vessel_moves. The vessels of the last arm, shift and moves are kept.
    std::vector<std::uint32_t> device_pixels(const CArm&, const SeenDevice&, const geometry::Vec3& shift);
    const std::vector<std::uint32_t>& vessel_pixels(const CArm&, const geometry::Vec3& shift,
                                                    std::span<const Eigen::Vector3f> moves = {});
    /// Ground truth: the vessel that each ray runs through longest, by labels given for the nodes of the
    /// vessels; 0 where there is none, everywhere without nodes. arm.pixels squared. Throws
    /// std::invalid_argument for another number of labels than nodes.
    DeepImage vessel_labels(const CArm&, const geometry::Vec3& shift, std::span<const std::uint16_t> of_node,
                            std::span<const Eigen::Vector3f> moves = {});

    /// Ground truth: the length of each ray in a layer, mesh and texture_blobs, where vessels, breath and
    /// heartbeat are in the exposure.
    struct LayerLength {
        std::string name;
        Material material, inside;
        Field length;  // [mm], arm.pixels squared
    };
    std::vector<LayerLength> layer_lengths(const CArm&, const Exposure&);

private:
    struct Patient;
    struct State;
    explicit Fluoroscope(std::unique_ptr<State>);
    std::unique_ptr<State> state_;
};

}  // namespace render
