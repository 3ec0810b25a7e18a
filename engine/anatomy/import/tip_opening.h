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

/// Cuts the mesh across the branches of these tips, each where the vessel has nearly its width near the tip
/// and the thinnest wire passes.
TipOpening open_tips(geometry::TriangleMesh&, const std::vector<geometry::CentrelineBranch>&,
                     const std::vector<VesselTip>&);

}  // namespace anatomy
