#pragma once
/// How much contrast a catheter passes.

#include "physics/wire/device.h"

namespace exercise {

/// Largest flow through a catheter at its rated pressure of 8.27 MPa (1200 psi), with a wire of this diameter
/// in `wire_inside` mm of it [ml/s]: laminar or turbulent (Blasius), whichever passes less. Contrast at body
/// temperature: 6 mPa·s, 1330 kg/m³. 0 where the wire fills the lumen.
double largest_flow(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside);

}  // namespace exercise
