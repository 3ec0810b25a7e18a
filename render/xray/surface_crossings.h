#pragma once
/// Where the rays of an image enter and leave a closed surface.

#include <cstdint>
#include <span>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/xray/c_arm.h"

namespace render {

struct Crossing {
    float depth;  // along the beam axis, from the plane of the isocentre [mm]
    bool entry;
};

/// Crossings, ray by ray. Ray (u, v) of `side` squared, v downward, passes through the middle of its fraction
/// of the detector.
struct SurfaceCrossings {
    int side = 0;
    std::vector<std::uint32_t> starts;  // of each ray in `list`, and the end
    std::vector<Crossing> list;         // nearest to the source first

    std::span<const Crossing> of(int u, int v) const {
        const std::size_t ray = static_cast<std::size_t>(v) * side + u;
        return {list.data() + starts[ray], starts[ray + 1] - starts[ray]};
    }
};

/// Uses `samples` rays along a side of a pixel. Rays enter a closed mesh exactly as often as they leave it,
/// also through edges and corners: these are decided in integers, after corners are moved by up to 2⁻¹⁵ of
/// the rays' spacing. Triangles within 1 mm of the source's plane are left out.
SurfaceCrossings surface_crossings(const geometry::TriangleMesh&, const CArm&, int samples);

}  // namespace render
