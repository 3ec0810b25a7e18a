#pragma once
/// The tube and its generator, and the automatic exposure control that sets both.

#include <functional>

#include "physics/geometry/state.h"

namespace render {

/// The output of tube and generator for one pulse, and the dose to the patient.
struct Technique {
    double kvp = 0.0;           // tube voltage [kV]
    double current = 0.0;       // during the pulse [mA]
    double pulse_width = 0.0;   // [ms]
    double air_kerma = 0.0;     // K_a,r: at the reference point, without backscatter [mGy]
    double area_product = 0.0;  // P_KA [Gy·cm²]
    double delivered = 1.0;  // fraction of the requested detector dose; below 1 the tube is at its limit [-]

    void state(geometry::StateStream& s) { s(kvp, current, pulse_width, air_kerma, area_product, delivered); }
};

/// Distance from the isocentre toward the tube at which K_a,r is defined (IEC 60601-2-43) [mm].
constexpr double reference_point = 150.0;

/// Air kerma at 1 m from the focal spot, behind the filtration of detected_spectrum [mGy/mAs]. The dependence
/// on voltage and filtration is that of the spectrum; the level is 0.080 mGy/mAs at 80 kV behind 2.5 mm Al,
/// between the rows of the University of Groningen's course data on radiation protection (0.05 to 0.13
/// mSv/mAs at 70 and 90 kV behind 2 and 3 mm Al).
double kerma_per_charge(double kvp);

/// Voltage, current and pulse width for a pulse that needs `charge(kvp)` [mAs] to give the detector its dose.
/// Voltage and current rise together with the patient's thickness, from 60 kV and 20 mA by 2 mA per kV to 120
/// kV, in pulses of 6 ms. The curve is this program's own, of the kind that manufacturers use. `charge` must
/// fall with voltage. Only kvp, current, pulse_width and delivered are set.
Technique automatic_exposure(const std::function<double(double kvp)>& charge);

/// The same at a given voltage. A thin patient gets shorter pulses, down to 1 ms, and then less current. When
/// pulses of 12 ms do not suffice, as in an acquisition, the current is raised, up to 60 kW; then pulses are
/// lengthened up to 100 ms; beyond that the dose falls short.
Technique exposure_at(double kvp, double charge);

}  // namespace render
