#pragma once
/// The part of an image that the pose of the C-arm and the tube voltage determine, before contrast and wire.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "render/xray/fluoroscope.h"
#include "render/xray/path_length.h"

namespace render {

using PixelBins = std::array<float, energy_bins>;

/// Sum over the bins.
inline float sum(const PixelBins& bins) {
    float result = 0.0f;
    for (float value : bins) result += value;
    return result;
}

/// Path lengths through all layers that change μ in the same way.
struct Mixture {
    Material material, inside;
    Field length;  // [mm]
};

/// Images that depend on size, distances and collimator, but not on the angles of the arm.
struct PlaneImages {
    CArm arm;
    Field flat, open, measured;  // open beam, collimator, measuring field: fractions of 1
};

/// A layer that covers few pixels: their indices, and the length of each pixel's ray in it [mm].
struct SparseLength {
    std::vector<std::uint32_t> pixels;
    std::vector<float> lengths;

    explicit SparseLength(const Field& length = {});
};

/// Images that depend on the pose, and cost the time of the mesh passes.
struct PoseImages {
    CArm arm;
    std::vector<Mixture> mixtures;
    SparseLength contrast;                  // through layers that take contrast
    std::map<int, SparseLength> organs;     // through each perfused layer
    std::optional<ContrastMatrix> vessels;  // made when contrast first needs it
    std::optional<DistalMatrix> distal;     // the same
    int unbalanced_pixels = 0;
};

/// Images that depend on the tube voltage as well.
struct BeamImages {
    EnergyBins bins;
    double kvp = 0.0;                // [kV]
    std::vector<PixelBins> primary;  // per pixel and bin, relative to the open beam, flat field included
    Field scatter;                   // in the same unit
    double gain = 0.0;               // quanta per unit and nGy
};

PlaneImages plane_images(const FluoroscopeConfig&, const CArm&);

/// Draws each layer's mesh, which has the same number in the renderer. `has_nodes`: contrast has vessels of
/// its own, and needs no lengths of lumina.
PoseImages pose_images(PathLengthRenderer&, std::span<const TissueLayer>, bool has_nodes, const CArm&);

/// Adds a length of `material` in place of `inside` along each pixel's ray [mm].
void add_length(PoseImages&, Material material, Material inside, const Field& length);

/// Tube charge of a pulse at that voltage that gives the detector 1 nGy [mAs], from a sample of the measuring
/// field.
double charge_per_dose(const FluoroscopeConfig&, const PlaneImages&, const PoseImages&, double kvp);

/// Images at a voltage [kV], or at the one that automatic exposure chooses.
BeamImages beam_images(const FluoroscopeConfig&, const PlaneImages&, const PoseImages&,
                       const std::optional<double>& kvp);

}  // namespace render
