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

/// Seed 0 gives the published means, changed only by what is wished of the patient; other seeds draw a
/// patient, and dimensions, angles and bends from the published spreads for such a patient. The same seed
/// gives the same bits. Throws InputError listing the presets when there is none of that name.
VesselTreeSpec vessel_preset(std::string_view name, std::uint64_t seed = 0, const PatientWish& = {});

/// The same, and how many drawn vessels were rejected before, for they could not be grown.
struct DrawnVessels {
    VesselTreeSpec spec;
    int rejected = 0;
};
DrawnVessels draw_vessels(std::string_view preset, std::uint64_t seed, const PatientWish& = {});

}  // namespace anatomy
