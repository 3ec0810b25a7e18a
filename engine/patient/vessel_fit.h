#pragma once
/// Whether vessels and a CT are of one patient, and lie in the same coordinates.

#include <string>

#include "engine/patient/ct_image.h"
#include "engine/patient/patient_files.h"
#include "physics/geometry/vec.h"

namespace patient {

/// How much of the vessels' wall lies where no vessel can.
struct VesselFit {
    double outside = 0;  // fraction beyond the CT's samples
    double in_air = 0;   // fraction within them, in air

    double wrong() const { return outside + in_air; }
};

/// More than this, and the CT is not of these vessels.
inline constexpr double most_wrong = 0.2;

/// Of 20000 places spread over the lumen's mesh, in the coordinates of the CT's grid. Air is below −900
/// HU, so that a lung is none.
VesselFit vessel_fit(const CtImage&, const geometry::TriangleMesh& wall);

/// What would bring them together: "rotation_deg = [0, 0, 180]", "shift_mm = [0, -200, 0]", keys of
/// [patient]; empty where no half turn about an axis, no shift of the middle of the one to the middle of the
/// other, and no both do. `turned` and `moved` are what those keys have already done to the CT.
std::string better_placement(const CtImage&, const geometry::TriangleMesh& wall, const geometry::Mat3& turned,
                             const geometry::Vec3& moved);

/// A sentence where vessels leave the CT, turned and moved as the files ask for, or lie in its air; empty
/// where they do not. Throws InputError, which names the CT and what would fit, where more than `most_wrong`
/// of them do; of a partial CT those in its air alone count.
std::string require_fit(const CtImage&, const geometry::TriangleMesh& wall, const PatientFiles&);

}  // namespace patient
