#pragma once
/// Vessel trees of published dimensions.

#include <cstdint>
#include <span>
#include <string_view>

#include "engine/anatomy/grow/vessel_tree.h"

namespace anatomy {

struct VesselPreset {
    std::string_view name, what;
};

/// All presets, in the order they are listed.
std::span<const VesselPreset> vessel_presets();

/// Seed 0 gives the published means; other seeds draw dimensions from the published spread, and bends of
/// their own. The same seed gives the same bits. Throws InputError listing the presets when there is none of
/// that name.
VesselTreeSpec vessel_preset(std::string_view name, std::uint64_t seed = 0);

}  // namespace anatomy
