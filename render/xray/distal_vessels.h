#pragma once
/// Arteries too small for a wire, which only the image shows: straight pieces of which contrast fills those
/// that it has reached.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"
#include "render/xray/contrast.h"

namespace render {

/// A cylinder, cut by planes. Its blood has the concentration of a node, thinned by `fill`, so that a vessel
/// can fade out.
/// In single precision: a patient has half a million of them.
struct VesselPiece {
    VesselPiece() = default;
    VesselPiece(const geometry::Vec3& start, const geometry::Vec3& end, float wide, float filled,
                std::uint32_t of, const geometry::Vec3& first_normal = geometry::Vec3::Zero(),
                const geometry::Vec3& last_normal = geometry::Vec3::Zero())
        : from(start.cast<float>()),
          to(end.cast<float>()),
          radius(wide),
          fill(filled),
          node(of),
          begins(first_normal.cast<float>()),
          ends(last_normal.cast<float>()) {}

    Eigen::Vector3f from = Eigen::Vector3f::Zero(), to = Eigen::Vector3f::Zero();  // [mm]
    float radius = 0;                                                              // [mm]
    float fill = 1;                                                                // [-]
    std::uint32_t node = 0;
    /// Normals of the planes that it ends at, where it joins another at an angle; zero: across it.
    Eigen::Vector3f begins = Eigen::Vector3f::Zero(), ends = Eigen::Vector3f::Zero();
};

/// Node → pixels that see its pieces, with the mean length of the pixel's ray through them [mm].
struct DistalMatrix {
    int width = 0;                       // of the square image [pixels]
    std::vector<std::uint32_t> starts;   // of each node's entries, plus one at the end
    std::vector<std::uint32_t> pixels;   // row by row from the top left
    std::vector<float> lengths;          // [mm]
    std::vector<geometry::Vec3> middle;  // of each node's pieces [mm]
};

/// Every piece casts the exact mean of its chords across its width, and along it what its ends cover; the
/// volume on the image is that of all pieces together, so that a place in several, as at a fork, counts once.
class DistalVessels {
public:
    /// Throws std::invalid_argument for numbers that are not finite, a radius that is not positive, or a
    /// node from `nodes` on.
    DistalVessels(std::vector<VesselPiece>, std::uint32_t nodes);

    std::uint32_t nodes() const { return static_cast<std::uint32_t>(middle_.size()); }
    /// The same arguments give the same bits.
    DistalMatrix at(const CArm&) const;

private:
    std::vector<VesselPiece> pieces_;  // by node
    std::vector<geometry::Vec3> middle_;
};

/// Adds Σ length · iodine of each node [mg/ml], and lists the pixels that were 0 before.
void add_iodine(const DistalMatrix&, std::span<const float> iodine, std::span<const PixelShift>, Field& out,
                std::vector<std::uint32_t>& touched);

}  // namespace render
