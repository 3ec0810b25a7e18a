#pragma once
/// What pulses cost the patient.

#include <array>

#include "engine/script/command.h"
#include "physics/geometry/state.h"
#include "render/xray/x_ray_tube.h"

namespace exercise {

struct DosePart {
    int pulses = 0;
    double air_kerma = 0;     // K_a,r [mGy]
    double area_product = 0;  // P_KA [Gy·cm²]

    void state(geometry::StateStream& s) { s(pulses, air_kerma, area_product); }
};

/// Dose of the attempt.
struct Dose : DosePart {
    std::array<DosePart, script::imaging_modes.size()> by_mode;
    render::Technique last;  // of the last pulse

    void add(script::ImagingMode mode, const render::Technique& technique) {
        for (DosePart* part : {static_cast<DosePart*>(this), &by_mode[static_cast<std::size_t>(mode)]}) {
            ++part->pulses;
            part->air_kerma += technique.air_kerma;
            part->area_product += technique.area_product;
        }
        last = technique;
    }
    void state(geometry::StateStream& s) {
        DosePart::state(s);
        for (DosePart& part : by_mode) part.state(s);
        s(last);
    }
};

}  // namespace exercise
