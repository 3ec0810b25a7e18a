#pragma once
/// Layers of tissue become a CT.

#include <span>

#include "engine/patient/ct_image.h"
#include "render/xray/fluoroscope.h"

namespace patient {

/// Hounsfield units of the layers in air, each voxel the mean over its cell: what a noiseless scanner of that
/// resolution would show. The layers' meshes are closed.
CtImage voxelised(std::span<const render::TissueLayer>, const render::VolumeGrid&, const Progress& = {});

/// A grid of cubes along the patient's axes that holds the box and a margin of two cubes.
render::VolumeGrid grid_around(const geometry::Vec3& low, const geometry::Vec3& high, double voxel);

/// Throws InputError for a name whose ending write_ct does not know.
void check_ct_name(const std::filesystem::path&);
/// Writes NIfTI (.nii, .nii.gz) or NRRD (.nrrd) by the name's ending. Throws InputError for another one, or
/// when it cannot be written.
void write_ct(const std::filesystem::path&, const CtImage&);

}  // namespace patient
