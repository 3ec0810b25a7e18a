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

/// Images that depend on size, distances and collimator, but not on the angles of the arm.
struct PlaneImages {
    CArm arm;
    Field flat, open, measured;  // open beam, collimator, measuring field: fractions of 1
    Field copper;                // of wedge and lung shutter [mm]; empty: none
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
};

/// Images that depend on the tube voltage as well.
struct BeamImages {
    EnergyBins bins;
    double kvp = 0.0;                // [kV]
    std::vector<PixelBins> primary;  // per pixel and bin, relative to the open beam, flat field included
    Field scatter;                   // in the same unit
    Field weights;                   // of each pixel in what automatic exposure measures [-]
    double gain = 0.0;               // quanta per unit and nGy
};

PlaneImages plane_images(const FluoroscopeConfig&, const CArm&);

/// Thickness of wedge and lung shutter on each pixel, together [mm]; empty: none is in the beam. Their shapes
/// are estimates: manufacturers give equivalents of 0.1 to 1 mm of copper and no drawings.
Field filter_thickness(const CArm&);
/// What passes them in each bin, relative to what arrives. `copper`: its attenuation [1/mm].
PixelBins filter_transmission(float thickness, const Bins& copper);

/// Draws each layer's mesh, which has the same number in the renderer. `has_nodes`: contrast has vessels of
/// its own, and needs no lengths of lumina.
PoseImages pose_images(PathLengthRenderer&, std::span<const TissueLayer>, bool has_nodes, const CArm&);

/// Adds a length of `material` in place of `inside` along each pixel's ray [mm].
void add_length(std::vector<Mixture>&, Material material, Material inside, const Field& length);

/// A kernel of 3 by 3 pixels with that covariance [pixels²], small against one; it adds up to 1.
struct SmallBlur {
    float middle = 1, across = 0, down = 0, falling = 0;  // falling: to lower right and upper left; rising: −
    explicit SmallBlur(const Eigen::Matrix2d& covariance);
};
/// Of a focal spot of that side [mm], at a distance from it [mm]: the spot's shadow, a square.
Eigen::Matrix2d focal_blur(const CArm&, double focal_spot, double depth);

/// Images at a voltage [kV], unsharp by the focal spot [mm]: what lies before and behind the isocentre as it
/// is 90 mm from it, a trunk's mean. `scatter`: relative to the open beam in its middle.
BeamImages beam_images(const PlaneImages&, const PoseImages&, double kvp, double focal_spot, Field scatter);

/// Those of a plane with `factor` times as many pixels on a side, bilinear; `scatter` as there.
BeamImages enlarged(const BeamImages&, int factor, const PlaneImages&, Field scatter);

/// μ of the mixture's material minus that of its surroundings [1/mm].
PixelBins change_of(const Mixture&, const EnergyBins&);

/// What each ray passes, as the length of soft tissue that scatters as much [mm].
Field scattering_thickness(std::span<const Mixture>, int pixels);

/// 1 in the disc where automatic exposure measures, 0 outside; `radius` on the detector [mm].
Field measuring_disc(const CArm&, double radius);

}  // namespace render
