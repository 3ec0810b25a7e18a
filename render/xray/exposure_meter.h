#pragma once
/// Automatic exposure: what the tube gives for a pulse, and the dose of it. It knows the patient by a few
/// rays, needs neither images nor OpenGL, and gives the same to the bit with images and without.

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/xray/beam_images.h"
#include "render/xray/coarse_lengths.h"
#include "render/xray/fluoroscope.h"

namespace render {

/// Throws std::invalid_argument with all the problems of arm and exposure.
void require_usable(const CArm&, const Exposure&);

/// What a meter keeps of layers: the meshes of those that show before contrast. Nobody changes it, so that
/// many meters may share one.
class MeteredLayers {
public:
    explicit MeteredLayers(std::span<const TissueLayer>);
    std::size_t count() const { return count_; }  // of all the layers

private:
    friend class ExposureMeter;
    struct Layer {
        Material material, inside;
        int mesh;
    };
    std::size_t count_;
    std::vector<Layer> layers_;
    CoarseLengths meshes_;
};

/// To be used by one thread at a time.
class ExposureMeter {
public:
    /// `known`: of more layers, before these.
    ExposureMeter(const FluoroscopeConfig&, std::span<const TissueLayer>,
                  std::vector<VolumeCaster> volumes = {}, std::shared_ptr<const MeteredLayers> known = {});

    /// The output of the tube and the dose to the patient for the pulse. Depends on pose, dose and voltage
    /// alone: wire and contrast do not change the exposure. Throws like require_usable.
    Technique technique(const CArm&, const Exposure&);

    /// The voltage asked for, or the one that automatic exposure chooses for the pose [kV].
    double voltage(const CArm&, const std::optional<double>& kvp);

    /// Scatter at that voltage on every pixel of the arm's image, relative to the open beam in its middle.
    Field scatter(const CArm&, double kvp);

private:
    static constexpr int places = 48;  // rays along either side of the open part of the field

    struct Beam {
        Field scatter;                 // of the coarse image, relative to the open beam
        double charge_per_dose = 0.0;  // [mAs/nGy]
    };
    struct Pose {
        CArm arm;     // as asked for
        CArm coarse;  // around the open part of the field
        std::vector<Mixture> mixtures;
        Field thickness, open, measured;
        std::map<double, Beam> beams;  // by voltage
        std::optional<double> automatic;
    };
    const Beam& beam(double kvp);
    void move_to(const CArm&);

    FluoroscopeConfig config_;
    std::vector<std::shared_ptr<const MeteredLayers>> layers_;
    std::vector<VolumeCaster> volumes_;
    std::optional<Pose> pose_;
};

}  // namespace render
