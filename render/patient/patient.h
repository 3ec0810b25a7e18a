#pragma once
/// A procedural patient around given vessels: skin, fat, skeleton and the organs that are seen on
/// fluoroscopy, as far as the vessels and the C-arm reach.
///
/// Layers that keep their names, so that others may move them or dissolve iodine in them: "left kidney",
/// "right kidney", "heart", "brain", "left lung", "right lung", "diaphragm".

#include <span>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/patient/body.h"
#include "render/xray/fluoroscope.h"

namespace render {

/// A ball of blood: where a vessel runs and how wide it is [mm].
struct VesselSample {
    geometry::Vec3 place;
    double radius;
};

struct PatientSpec {
    geometry::Vec3 lower = geometry::Vec3(-75, -40, -190);  // box around the vessels [mm]
    geometry::Vec3 upper = geometry::Vec3(75, 40, 130);     // [mm]
    geometry::Vec3 origin = geometry::Vec3(0, 14, 0);       // of the body frame, in that of the vessels [mm]
    double width = 375.0;                                   // of the abdomen, left to right [mm]
    double depth = 225.0;                                   // of the abdomen, front to back [mm]
    std::vector<VesselSample> vessels;                      // that the lungs leave room for
    bool bowel_gas = true;
};

/// A patient whose landmark lies where the vessels have it, whose spine stands behind the aorta and whose
/// trunk holds them all. `wall`: points of the vessels' wall [mm].
PatientSpec patient_around(std::span<const geometry::Vec3> wall, const geometry::BodyPlace&);

/// Closed meshes only: the parts of the body that the vessels' box, with a margin, reaches. The lumen is not
/// among them; the vessels' blood counts as soft tissue.
std::vector<TissueLayer> make_patient(const PatientSpec&);

}  // namespace render
