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

}  // namespace anatomy
