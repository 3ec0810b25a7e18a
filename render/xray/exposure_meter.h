#pragma once
/// Automatic exposure: what the tube gives for a pulse, and the dose of it. It knows the patient by a few
/// rays, needs neither images nor OpenGL, and gives the same to the bit with images and without.

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/beam_images.h"
#include "render/xray/c_arm.h"
#include "render/xray/fluoroscope.h"

namespace render {

/// Meshes, cut by the rays to the pixel centres of a coarse image. The result depends on the arguments alone.
class CoarseLengths {
public:
    /// Keeps a copy of the mesh in single precision; returns its number. Throws std::invalid_argument for a
    /// triangle with a vertex that does not exist.
    int add(const geometry::TriangleMesh&);

    /// Displacements of a mesh's vertices, each one for every vertex or none [mm], and the fractions of them.
    struct Moves {
        std::array<std::span<const Eigen::Vector3f>, movers> of;
        MoverFractions fractions{};
    };
    /// Adds the length of each pixel's ray inside the mesh to `sum` [mm], arm.pixels squared. A ray that
    /// enters and leaves unequally often, as where the mesh reaches behind the source, adds nothing.
    void accumulate(int mesh, const CArm& arm, Field& sum) const { accumulate(mesh, arm, sum, {}); }
    void accumulate(int mesh, const CArm&, Field& sum, const Moves&) const;

private:
    struct Mesh {
        std::vector<std::array<float, 3>> vertices;
        std::vector<std::array<int, 3>> triangles;
    };
    std::vector<Mesh> meshes_;
};

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
        int mesh, number;  // the latter among all the layers
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
                  std::vector<VolumeRayCaster> volumes = {}, std::shared_ptr<const MeteredLayers> known = {});

    /// From that arm alone, where another one's lengths_at() were these.
    ExposureMeter(const FluoroscopeConfig&, const CArm&, std::vector<Mixture> lengths);
    /// What it knows of the patient from that arm.
    const std::vector<Mixture>& lengths_at(const CArm&);

    /// The output of the tube and the dose to the patient for the pulse. Depends on pose, dose and voltage
    /// alone: wire and contrast do not change the exposure. Throws like require_usable.
    Technique technique(const CArm&, const Exposure&);

    /// The voltage asked for, or the one that automatic exposure chooses for the pose [kV].
    double voltage(const CArm&, const std::optional<double>& kvp);

    /// Scatter at that voltage on every pixel of the arm's image, relative to the open beam in its middle.
    Field scatter(const CArm&, double kvp);

    /// What passes to the detector in the measuring field, with scatter, relative to the open beam there.
    double measured(const CArm&, double kvp);

    /// Lengths through layers and volumes, made by all processors without OpenGL. `layers`: all that the
    /// meter was made with, for their displacements, of which they have these fractions, and their texture;
    /// none: without these.
    std::vector<Mixture> lengths(const CArm&, std::span<const TissueLayer> layers,
                                 const MoverFractions&) const;

private:
    static constexpr int places = 48;  // rays along either side of the open part of the field

    struct Beam {
        Field scatter;                 // of the coarse image, relative to the open beam
        double charge_per_dose = 0.0;  // [mAs/nGy]
        double measured = 0.0;
        // Air kerma that passes the filters: of the open field's, and of that in its middle [-].
        double filtered = 1.0, filtered_middle = 1.0;
    };
    struct Pose {
        CArm arm;     // as asked for
        CArm coarse;  // around the open part of the field
        std::vector<Mixture> mixtures;
        Field thickness, open, measured, copper;
        std::map<double, Beam> beams;  // by voltage
        std::optional<double> automatic;
    };
    const Beam& beam(double kvp);
    void move_to(const CArm&);
    Pose posed(const CArm&, std::vector<Mixture>) const;

    FluoroscopeConfig config_;
    std::vector<std::shared_ptr<const MeteredLayers>> layers_;
    std::vector<VolumeRayCaster> volumes_;
    std::optional<Pose> pose_;
};

/// A disc in the middle of the image, without what the collimator closes and without direct radiation: rays
/// that pass beside the patient would otherwise decide, being some hundred times as bright. Both edges are
/// soft, so that the exposure follows a moving arm without jumps. Parts that are much thinner than the rest,
/// as a neck above shoulders, are left out in the same way. Of the rest, bright parts, as the inner sides of
/// two thighs, count as if they were hardly brighter than the dark ones. Where hardly anything of the patient
/// is in the disc, the whole disc counts.
class MeasuringField {
public:
    /// Below `nothing` of soft tissue a ray counts as direct, above `body` as one through the patient [mm].
    static constexpr float nothing = 10.0f, body = 40.0f;
    /// Of the mean thickness, in which thick parts count more: below the first a part does not count, above
    /// the second it does in full [-].
    static constexpr float thin = 0.3f, thick = 0.6f;
    /// No part counts as brighter than `brightest` times the mean of the dark parts: what lies between these
    /// two quantiles of the patient [-].
    static constexpr double brightest = 2.0, darkest = 0.1, dark = 0.4;
    /// From this fraction of the disc on the patient alone is measured; below, both means count [-].
    static constexpr double enough = 0.25;

    /// `disc`: fraction of each pixel that is in the disc and open [-]; `thickness`: of what its ray passes,
    /// as soft tissue that scatters as much [mm].
    MeasuringField(const Field& disc, const Field& thickness);

    /// Mean of a signal, which must not be negative; that of patient and disc are mixed as logarithms.
    double mean(std::span<const float> signal) const;
    /// Of each pixel in the mean that a display shows in middle grey [-].
    Field weights() const;

private:
    Field disc_, patient_;  // weights of the two means [-]
    double disc_sum_ = 0.0, patient_sum_ = 0.0, patient_alone_ = 0.0;
};

}  // namespace render
