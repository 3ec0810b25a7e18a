#pragma once
/// The branches of a lumen: ways from its inlet to its ends and tips, merged to a tree of centrelines.

#include <functional>
#include <optional>

#include "engine/anatomy/import/mesh_repair.h"
#include "physics/geometry/centreline_tree.h"

namespace anatomy {

struct TracingOptions {
    double voxel = 0;  // [mm]
    double step = 0;   // between samples of a centreline [mm]
    int threads = 1;   // the branches have the same bits for any number
    std::function<void(double)> progress;
};

/// A blind end of the lumen, near which it can be cut open.
struct VesselTip {
    geometry::Vec3 apex, centre;  // the far wall, and the last place of the centreline [mm]
    geometry::Vec3 outward;       // unit
    double radius = 0;            // [mm]
};

struct TracedLumen {
    std::vector<geometry::CentrelineBranch> branches;  // unnamed; parents first
    std::vector<int> end_of_branch;  // index of the opening that each reaches, -1 = a tip or a loop
    std::vector<VesselTip> tips;     // not at an opening
    int loops = 0;                   // branches that end in another
    int spurs = 0;                   // bulges too short for a branch, left out
    std::vector<int> unreached;      // openings that no way leads to
};

/// Ways through the voxels of the lumen. `inlet` is an opening; -1, for a closed lumen, starts at the tip
/// farthest from anywhere.
TracedLumen trace_lumen(const geometry::TriangleMesh& open, const std::vector<MeshOpening>&, int inlet,
                        const TracingOptions&);

/// The same from given lines, which are joined where one starts or ends near another. Places
/// outside the lumen are left out before the lines are recentred.
TracedLumen trace_lines(const geometry::TriangleMesh& open, const std::vector<MeshOpening>&, int inlet,
                        const std::vector<geometry::Polyline>& lines, const TracingOptions&);

}  // namespace anatomy
