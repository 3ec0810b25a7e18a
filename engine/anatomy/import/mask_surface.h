#pragma once
/// The surface of a vessel that a program has marked voxel by voxel.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "engine/anatomy/import/mesh_repair.h"
#include "render/xray/volume.h"

namespace anatomy {

struct VesselMask {
    render::VolumeGrid grid;           // in the patient's frame
    std::vector<std::uint8_t> inside;  // 1 in the vessel, else 0; first axis fastest
};

struct MaskSurface {
    geometry::TriangleMesh mesh;  // outward, open where the vessel is cut by the border of the grid [mm]
    std::vector<Finding> findings;
};

/// The smooth surface of the largest piece of the mask. Cavities are filled; pieces of less than a quarter of
/// the largest are left out. A voxel belongs to the vessel if its centre does: steps of that are smoothed by
/// a Gaussian of 1.5 voxels, of 2.5 where the vessel is wide, and what this shrinks is given back by
/// comparing, twice or four times, the smoothed mask with the smoothed inside of the surface found. Where the
/// vessel runs into the border of the grid, it goes on there and is cut at the last voxels. Throws InputError
/// for a mask that is empty or has a second large piece.
MaskSurface surface_of(VesselMask, const std::function<void(double)>& progress = {});

}  // namespace anatomy
