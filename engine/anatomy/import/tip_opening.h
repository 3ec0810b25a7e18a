#pragma once
/// Opens vessels that end blind, so that wires can enter there and blood can leave.

#include <vector>

#include "engine/anatomy/import/lumen_tracing.h"

namespace anatomy {

struct TipOpening {
    std::vector<VesselTip> opened;   // where they were cut
    std::vector<VesselTip> thin;     // not wide enough for the thinnest wire anywhere near
    std::vector<VesselTip> refused;  // whose surface cannot be cut across in one loop
};

/// Whether the tip is the end of a tube, not a sac: no place on the last three radii of the branch has less
/// than 0.6 of the radius near the tip, and a branch that is not so long outside its parent is not wider than
/// it.
bool ends_a_tube(const std::vector<geometry::CentrelineBranch>&, const VesselTip&);

/// The largest radius on the last two radii of the way to the tip [mm].
double width_near(const std::vector<geometry::CentrelineBranch>&, const VesselTip&);

/// Cuts the mesh across the branches of these tips, each where the vessel has nearly its width near the tip
/// and the thinnest wire passes.
TipOpening open_tips(geometry::TriangleMesh&, const std::vector<geometry::CentrelineBranch>&,
                     const std::vector<VesselTip>&);

}  // namespace anatomy
