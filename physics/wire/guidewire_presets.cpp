#include "physics/wire/guidewire_presets.h"

#include <array>
#include <numbers>

#include "physics/geometry/vec.h"

namespace physics {
namespace {

/// Lengths [mm], rigidities [N·mm²], angle of the curved tip [rad].
physics::GuidewireSpec wire(double segment_length, double diameter, double shaft_rigidity,
                            double tip_rigidity, double tip_length, double transition_length,
                            double curved_length, double curved_angle) {
    return {.segment_length = segment_length,
            .diameter = diameter,
            .shaft_rigidity = shaft_rigidity,
            .tip_rigidity = tip_rigidity,
            .tip_length = tip_length,
            .transition_length = transition_length,
            .curved_length = curved_length,
            .curved_angle = curved_angle};
}

// Shafts of 0.035 in: EI = E·πd⁴/64 with E of Harrison et al., J Endovasc Ther 2011;18:797, measured more
// than 60 cm from the tip. Tips of 0.035 in: Qiu et al. 2023 (PMC10760252). Transition of 15 to 25 cm: the
// same. Wires of 0.014 in: tip from the tip load as a cantilever, EI = F·L³/3δ with L = 10 mm and δ = 2 mm.
// Lengths: of those in use, 1450 to 3000 mm, and 1750 to 1900 mm for the coronary arteries.
const std::array<GuidewirePreset, 7> presets = {{
    {"floppy014", wire(1.0, 0.356, 40, 1.6, 30, 150, 6, 45 * geometry::degree), 1900,
     "shaft 40 N·mm² estimated; tip 1.6 N·mm² from a tip load of 1 gf; bend of 45° over 6 mm estimated"},
    {"standard014", wire(1.0, 0.356, 80, 5, 30, 150, 6, 45 * geometry::degree), 1900,
     "shaft 80 N·mm² estimated; tip 5 N·mm² from a tip load of 3 gf; bend of 45° over 6 mm estimated"},
    {"v18", wire(1.0, 0.457, 200, 13, 40, 150, 6, 45 * geometry::degree), 2000,
     "shaft 200 N·mm² estimated; tip 13 N·mm² from a tip load of 8 gf; bend of 45° over 6 mm estimated"},
    {"glide035", wire(2.0, 0.889, 250, 6, 30, 150, 12, 45 * geometry::degree), 1800,
     "shaft 250 N·mm² estimated; tip 6 N·mm² of a Glidewire (Qiu 2023); 45° angled, bend over 12 mm"},
    {"bentson035", wire(2.0, 0.889, 290, 2, 60, 150, 0, 0), 1450,
     "shaft 291 N·mm² of an Amplatz (Harrison 2011) taken for it; tip 2 N·mm² of a Bentson (Qiu 2023); "
     "straight"},
    {"jwire035", wire(1.0, 0.889, 290, 15, 30, 150, 3 * std::numbers::pi, std::numbers::pi), 1500,
     "shaft 291 N·mm² (Harrison 2011); tip 15 N·mm² of a J-wire (Qiu 2023); J of radius 3 mm"},
    {"amplatzSS035", wire(2.0, 0.889, 1850, 15, 60, 150, 0, 0), 1800,
     "shaft 1849 N·mm² of an Amplatz Super Stiff (Harrison 2011); tip 15 N·mm² estimated; straight"},
}};

}  // namespace

std::span<const GuidewirePreset> guidewire_presets() {
    return presets;
}

const GuidewirePreset* find_guidewire_preset(std::string_view name) {
    for (const GuidewirePreset& preset : presets) {
        if (preset.name == name) return &preset;
    }
    return nullptr;
}

}  // namespace physics
