#pragma once
/// Guidewires by name, with where their numbers come from.

#include <span>
#include <string_view>

#include "physics/wire/guidewire.h"

namespace physics {

struct GuidewirePreset {
    std::string_view name;
    physics::GuidewireSpec spec;
    double length;            // of the whole wire [mm]
    std::string_view source;  // of the rigidities and the shape of the tip
};

std::span<const GuidewirePreset> guidewire_presets();
const GuidewirePreset* find_guidewire_preset(std::string_view name);  // null when there is none

}  // namespace physics
