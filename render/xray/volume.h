#pragma once
/// Materials on a grid of samples, as of a CT, and the lengths of rays through them.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"
#include "render/xray/materials.h"

namespace render {

/// Places of samples: sample (i, j, k) is at origin + i·steps[0] + j·steps[1] + k·steps[2]. The steps need
/// not be perpendicular.
struct VolumeGrid {
    geometry::Vec3 origin = geometry::Vec3::Zero();  // of the first sample [mm]
    std::array<geometry::Vec3, 3> steps = {geometry::Vec3::UnitX(), geometry::Vec3::UnitY(),
                                           geometry::Vec3::UnitZ()};  // [mm]
    std::array<int, 3> size = {0, 0, 0};

    geometry::Vec3 at(double i, double j, double k) const {
        return origin + i * steps[0] + j * steps[1] + k * steps[2];
    }
    geometry::Mat3 axes() const;  // the steps as columns [mm]
    std::size_t count() const {
        return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
               static_cast<std::size_t>(size[2]);
    }
    std::size_t index(int i, int j, int k) const {
        return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) +
                static_cast<std::size_t>(j)) *
                   static_cast<std::size_t>(size[0]) +
               static_cast<std::size_t>(i);
    }
    bool operator==(const VolumeGrid&) const = default;
};

/// What a sample says of one material: the fraction of the place that `material` takes in place of `inside`
/// [-]. It may be negative or above 1. Shares are linear between the knots and constant outside them.
struct VolumePart {
    struct Knot {
        double sample, fraction;
    };
    Material material = Material::SoftTissue;
    Material inside = Material::Air;
    std::vector<Knot> knots;  // samples ascend
};

/// A sample is a number (a CT's HU, or any code) that `parts` turns into fractions of materials. Between
/// samples the fractions are linear; along an axis whose samples are 1.2 mm apart or more they are quadratic
/// B-splines, for linear ones are sharper at samples than between them, which shows as moiré. Beyond the
/// outermost samples they fall to 0 within one step, or one and a half.
struct DensityVolume {
    std::string name;
    VolumeGrid grid;
    std::vector<std::int16_t> samples;  // i fastest, then j, then k
    std::vector<VolumePart> parts;
};

/// Everything that makes the volume unusable, a sentence each; empty when it can be cast.
std::vector<std::string> problems(const DensityVolume&);

/// Casts rays by the method of Joseph (IEEE Trans. Med. Imaging 1:192–196, 1982): along the grid axis of
/// which a ray crosses most layers, one interpolation a layer. It is exact for shares that are
/// linear in space. Copies share the samples.
class VolumeRayCaster {
public:
    /// `threads` = 0: one for each processor. Lengths do not depend on it. Throws std::invalid_argument with
    /// all problems of the volume.
    explicit VolumeRayCaster(DensityVolume, int threads = 0);

    const std::vector<VolumePart>& parts() const;

    /// For each part the integral of its fraction along the ray from the source to each pixel's centre [mm],
    /// arm.pixels squared. Where pixels lie closer than the smallest step, rays are cast that far apart (at
    /// the volume's far side) and the lengths interpolated by cubic B-splines: in a CT's images the
    /// difference is a tenth of what its voxels blur.
    std::vector<Field> lengths(const CArm&) const;
    /// The same with a ray for each pixel in any case.
    std::vector<Field> every_length(const CArm&) const;

private:
    struct State;
    std::shared_ptr<const State> state_;
};

/// The square field without `margin` pixels on each side, at `pixels` along a side: the cubic B-spline
/// through the given values at the new pixels' centres. Exact for cubic polynomials away from the outer edge.
Field spline_enlarged(Field, int margin, int pixels);

}  // namespace render
