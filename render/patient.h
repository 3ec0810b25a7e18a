#pragma once
/// A procedural patient around given vessels: trunk, lumbar spine, lowest ribs, pelvis, kidneys, bowel gas.

#include <span>
#include <vector>

#include "physics/geometry.h"
#include "render/fluoroscope.h"

namespace render {

struct PatientSpec {
    physics::Vec3 lower = physics::Vec3(-75, -40, -190);  // box around the vessels [mm]
    physics::Vec3 upper = physics::Vec3(75, 40, 130);     // [mm]
    double spine_x = 0.0;       // of the column's middle, toward the patient's left [mm]
    double spine_front = 14.0;  // y of the anterior face of the vertebral bodies [mm]
    double bifurcation = 0.0;   // z of the aortic bifurcation, which stands before L4 [mm]
    double width = 375.0;       // of the trunk, left to right [mm]
    double depth = 225.0;       // of the trunk, front to back [mm]
    bool bowel_gas = true;
};

/// A patient whose spine stands behind the highest vessel points (the aorta) and whose trunk holds them all.
/// `points`: centreline or wall points [mm]; `bifurcation`: z of the aortic bifurcation [mm].
PatientSpec patient_around(std::span<const physics::Vec3> points, double bifurcation);

/// Closed meshes only. The lumen is not among them; the vessels' blood counts as soft tissue.
std::vector<TissueLayer> make_patient(const PatientSpec&);

}  // namespace render
