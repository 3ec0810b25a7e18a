#pragma once
/// The branches of a lumen: paths from its inlet to its ends and tips, merged into a tree of centrelines.

#include <functional>

#include "engine/anatomy/import/mesh_repair.h"
#include "physics/geometry/centreline_tree.h"

namespace anatomy {

struct TracingOptions {
    double voxel = 0;     // [mm]
    double step = 0;      // between samples of a centreline [mm]
    int most_tips = 500;  // more are not followed
    int threads = 1;      // the branches have the same bits for any number
    std::function<void(double)> progress;
};

/// A blind end of the lumen, where it can be cut open.
struct VesselTip {
    geometry::Vec3 apex = geometry::Vec3::Zero();     // the far wall [mm]
    geometry::Vec3 centre = geometry::Vec3::Zero();   // the last point of the centreline [mm]
    geometry::Vec3 outward = geometry::Vec3::Zero();  // unit
    double radius = 0;                                // [mm]
    int branch = 0;                                   // that ends here
    bool at_start = false;                            // of that branch: it is the root
};

struct TracedLumen {
    std::vector<geometry::CentrelineBranch> branches;  // unnamed; parents first
    std::vector<int> end_of_branch;  // index of the opening that each one reaches, -1 = a tip or a loop
    std::vector<VesselTip> tips;     // blind ends, not at an opening
    int loops = 0;                   // branches that end in another
    int spurs = 0;                   // bulges too short for a branch, left out
    std::vector<int> unreached;      // openings that no path leads to
};

/// Traces paths through the voxels of the lumen. `inlet` is an opening; -1, for a closed lumen, starts at the
/// most distant tip.
TracedLumen trace_lumen(const geometry::TriangleMesh& open, const std::vector<MeshOpening>&, int inlet,
                        const TracingOptions&);

/// The same from given lines, which are joined where one starts or ends near another. Points outside the
/// lumen are dropped before the lines are recentred.
TracedLumen trace_lines(const geometry::TriangleMesh& open, const std::vector<MeshOpening>&, int inlet,
                        const std::vector<geometry::Polyline>& lines, const TracingOptions&);

}  // namespace anatomy
