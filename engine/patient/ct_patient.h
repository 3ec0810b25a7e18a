#pragma once
/// A patient from files: a CT in place of the procedural body, and meshes of what has been segmented.

#include <string>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/patient/patient_files.h"
#include "render/xray/fluoroscope.h"

namespace patient {

/// The CT as a volume of materials in air, in the anatomy's coordinates, cropped to the body, whose last
/// slice is carried on for 120 mm, fading, where the scan cuts it off toward head or feet: without the table,
/// and with blood in place of the contrast in `lumen` (closed) unless it is to be kept. Preparing takes
/// seconds; the result is kept in the cache. Throws InputError.
render::DensityVolume ct_volume(const PatientFiles&, const geometry::TriangleMesh& lumen,
                                const anatomy::ModelCache& = {});

/// The meshes as layers named after their files, in the anatomy's coordinates; one that is inside out is
/// turned. Throws InputError for one that cannot be read or is not closed.
std::vector<render::TissueLayer> mesh_layers(const PatientFiles&);

/// Which meshes were turned from RAS, and why. Throws InputError for one that cannot be read.
std::vector<std::string> mesh_notes(const PatientFiles&);

}  // namespace patient
