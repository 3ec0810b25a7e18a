#pragma once
/// Which ends an imported lumen has: blind tips that are cut open, and the inlet.

#include <optional>
#include <string>
#include <vector>

#include "engine/anatomy/import/lumen_tracing.h"
#include "engine/anatomy/import/mesh_repair.h"

namespace anatomy {

/// Places that the user gives for ends [mm].
struct GivenEnds {
    std::optional<geometry::Vec3> inlet;  // near the end, or the blind tip, where wires enter
    std::vector<geometry::Vec3> tips;     // near blind tips that are to be cut open
    bool tubes = false;                   // cut all blind tips open that are ends of tubes
};

/// Cuts blind tips open: those near the places given; where no tip is given and fewer than two ends are open,
/// or the widest vessel is closed, all that are ends of tubes, so that sacs stay closed. Reports what it did
/// in the findings. Returns whether the surface has changed. Throws InputError for a place with no tip or end
/// near it, and for fewer than two ends.
bool open_missing_ends(RepairedLumen&, const TracedLumen&, const GivenEnds&, std::vector<Finding>&);

/// Index of the end that wires enter by: the one nearest to the place given, else the first. Throws
/// InputError for a place that is far from every end.
int chosen_inlet(const std::vector<MeshOpening>&, const GivenEnds&, std::vector<Finding>&);

/// Places and radii of up to 20 tips.
std::string places_text(const std::vector<VesselTip>&);

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
