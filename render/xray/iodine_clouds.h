#pragma once
/// Iodine that lies in no vessel and no organ: what has leaked into tissue.

#include <cstdint>
#include <span>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace render {

/// A cloud without an edge: its concentration is that of a normal distribution.
struct IodineCloud {
    geometry::Vec3 middle = geometry::Vec3::Zero();  // [mm]
    double spread = 1;                               // standard deviation in each direction, above 0 [mm]
    double iodine = 0;                               // in all [mg]

    void state(geometry::StateStream& s) { s(middle, spread, iodine); }
};

/// Adds what rays pass in the clouds to `iodine` [mg/ml·mm], and the pixels that had none to `pixels`. A
/// cloud counts to four standard deviations, which leaves out 0.03 % of it; one whose middle is not before
/// the source is left out.
void add_clouds(const CArm&, std::span<const IodineCloud>, Field& iodine, std::vector<std::uint32_t>& pixels);

/// Pixels whose ray passes more iodine in the clouds than that [mg/ml·mm], in ascending order.
std::vector<std::uint32_t> cloud_pixels(const CArm&, std::span<const IodineCloud>, double above);

}  // namespace render
