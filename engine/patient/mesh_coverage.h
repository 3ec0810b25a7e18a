#pragma once
/// Which fraction of each voxel a closed mesh fills.

#include <array>
#include <vector>

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

}  // namespace patient
