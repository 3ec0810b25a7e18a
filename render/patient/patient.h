#pragma once
/// A procedural patient around given vessels: skin, fat, skeleton and the organs that fluoroscopy shows, as
/// far as the vessels and the C-arm reach.
///
/// Layers with fixed names, by which other code may move them or dissolve iodine in them: "left kidney",
/// "right kidney", "heart", "brain", "left lung", "right lung", "diaphragm". Parts in which contrast shows on
/// its own: "left kidney cortex", "left kidney medulla" (the same on the right); "brain, left ACA", MCA and
/// PCA on both sides, "brain, cerebellum and stem".

#include <cstdint>
#include <span>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/patient/body.h"
#include "render/patient/texture_pattern.h"
#include "render/xray/fluoroscope.h"

namespace render {

/// A ball of blood: a place and radius of a vessel [mm].
struct VesselSample {
    geometry::Vec3 place;
    double radius;
};

struct PatientSpec {
    geometry::Vec3 lower = geometry::Vec3(-75, -40, -190);  // box around the vessels [mm]
    geometry::Vec3 upper = geometry::Vec3(75, 40, 130);     // [mm]
    geometry::Vec3 origin = geometry::Vec3(0, 14, 0);       // of the body frame, in the vessels' frame [mm]
    double width = 375.0;                                   // of the abdomen, left to right [mm]
    double depth = 225.0;                                   // of the abdomen, front to back [mm]
    std::vector<VesselSample> vessels;                      // the lungs leave room for these
    bool bowel_gas = true;
    std::uint64_t seed = 0;  // of what differs from patient to patient; 0 = means
};

/// A patient whose landmark lies where the vessels place it, whose spine stands behind the aorta and whose
/// trunk encloses all vessels. `wall`: points of the vessels' wall [mm].
PatientSpec patient_around(std::span<const geometry::Vec3> wall, const geometry::BodyPlace&);

/// Closed meshes only: the parts of the body within reach of the vessels' box plus a margin. The lumen is not
/// among them; the vessels' blood counts as soft tissue. Corners are multiples of corner_step. `textures`: of
/// each layer how its blobs come about.
std::vector<TissueLayer> make_patient(const PatientSpec&, std::vector<LayerTexture>* textures = nullptr);

}  // namespace render
