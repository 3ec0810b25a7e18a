#pragma once
/// What a CT shows and a fluoroscope should not: the table, and contrast that is not ours.

#include "engine/patient/ct_image.h"

namespace patient {

/// Sets everything outside the body to air: the table, clothes, noise. On cells of about 2 mm, tissue above
/// −400 HU is thinned by two cells, which parts a table from the skin. Of what then hangs together the body
/// are pieces at least a quarter as large as the largest one, and those with bone in soft tissue, whatever
/// their size; besides, shells of bone that are too thin for that, unless they lie before or behind the body
/// as rails of a table do; and all that these enclose in each layer across the patient (lungs, gas), and one
/// cell more. The CT's notes say what has gone, and where it was. The grid's axes are the patient's: +y is
/// the back. Throws InputError, which names `file`, when there is no body.
void remove_surroundings(CtImage&, const std::filesystem::path& file);

/// Makes the contrast in a lumen blood: a voxel within becomes blood, one on its wall loses the contrast's
/// part. That part is the fraction of the lumen in the 3 × 3 × 3 voxels about it, doubled, up to 1: all of it
/// up to the wall, none from one and a half voxels beyond it, which is about the blur of a scanner. What is
/// removed there is the mean excess over blood within the lumen nearby; no voxel falls below blood, so that
/// bone beside a vessel stays. `lumen` is closed [mm].
void replace_contrast(CtImage&, const geometry::TriangleMesh& lumen);

}  // namespace patient
