#pragma once
/// The presets of each region of the body, as they are listed in vessel_presets.cpp. Every dimension has its
/// source beside it; "estimate" marks those without one.

#include "engine/anatomy/grow/variation.h"

namespace anatomy {

// Abdomen and legs. The axes are those of DICOM: +x left, +y back, +z head; the aorta divides at the origin.
VesselTreeSpec iliac_renal(Variation&);
VesselTreeSpec femoral(Variation&);

struct ArchShape {
    double drop;             // of the brachiocephalic origin below the arch's top, in LCCA diameters
    double lowest, highest;  // limits of the drop among patients
    bool bovine;             // the left common carotid comes off the brachiocephalic trunk
    bool arms = false;       // to both wrists; the neck's arteries are then cut short
};
VesselTreeSpec arch(Variation&, const ArchShape&);
VesselTreeSpec whole_aorta(Variation&);
VesselTreeSpec arch_with_coronary(Variation&);

VesselTreeSpec left_coronary(Variation&);
VesselTreeSpec right_coronary(Variation&);

VesselTreeSpec cerebral(Variation&);
VesselTreeSpec circle_of_willis(Variation&);

}  // namespace anatomy
