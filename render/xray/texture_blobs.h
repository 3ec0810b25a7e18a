#pragma once
/// Texture of tissue: small bodies with more or less of a material than what is around them. Their images are
/// those of texture_blobs in space, so that texture has parallax like everything else.

#include <Eigen/Core>
#include <span>

#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace render {

/// An ellipsoid of revolution in which a material's fraction of the place is raised by fraction · (1 −
/// ρ²)^(3/2); ρ is 0 in the middle and 1 on the surface. So its image is smooth: (3π/16) · fraction · chord ·
/// (1 − d²)², with the chord through the middle, and d from 0 in the middle of the image to 1 at its edge.
struct TextureBlob {
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();  // [mm]
    Eigen::Vector3f axis = Eigen::Vector3f::UnitZ();   // of revolution, unit
    float radius = 1.0f;                               // half-axis across [mm]
    float elongation = 1.0f;                           // half-axis along over that across [-]
    float fraction = 1.0f;                             // negative: less of the material [-]
};

/// Integral of the fraction over the blob's volume [mm³].
double content(const TextureBlob&);

/// Adds to `sum`, arm.pixels squared, the integral of the fractions along each pixel's ray [mm], averaged
/// over pixels: a blob smaller than a pixel keeps its content. TextureBlobs within 1 mm of the source's plane
/// or behind it add nothing. Those nearer to the source than the isocentre are added to `before` too, unless
/// it is null. The same arguments give the same bits.
void add_lengths(std::span<const TextureBlob>, const CArm&, Field& sum, Field* before = nullptr);

}  // namespace render
