#pragma once
/// Layers of tissue become a CT: which fraction of each voxel a closed mesh fills.

#include <array>
#include <span>
#include <vector>

#include "engine/patient/ct_image.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/volume.h"

namespace patient {

/// Fractions by lines along the grid's first axis, `lines` × `lines` of them through each voxel; along a line
/// the fraction is exact. Where the mesh encloses a place twice, it counts twice, as in path lengths.
class MeshCoverage {
public:
    /// The mesh is closed, its corners finite, its triangles counter-clockwise from outside.
    MeshCoverage(const geometry::TriangleMesh&, const render::VolumeGrid&, int lines = 3);

    /// Layers along the third axis in which it fills anything, the last exclusive.
    int first_layer() const { return first_; }
    int end_layer() const { return first_ + static_cast<int>(touching_.size()); }
    /// The voxels of a layer that it may fill lie within these, the last exclusive.
    struct Window {
        int first_column = 0, end_column = 0, first_row = 0, end_row = 0;
    };
    const Window& window() const { return window_; }
    /// Fractions of the layer's voxels, first axis fastest; `fractions` becomes size[0]·size[1] long.
    void layer(int k, std::vector<float>& fractions) const;

private:
    std::array<int, 3> size_;
    int lines_, first_ = 0;
    Window window_;
    std::vector<std::array<geometry::Vec3, 3>> triangles_;  // in the grid's indices
    std::vector<std::vector<int>> touching_;                // triangles of each layer from `first_` on
};

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
