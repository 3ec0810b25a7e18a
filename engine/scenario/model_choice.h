#pragma once
/// How fine a wire and which wall a vessel needs, and why.

#include <string>

#include "engine/anatomy/anatomy.h"
#include "engine/scenario/scenario.h"

namespace scenario {

/// The narrowest place and the sharpest bend of an anatomy.
struct LumenDemand {
    double smallest_radius = 0;    // [mm]
    std::string narrowest;         // branch that holds it
    int narrowest_sample = 0;      // of that branch's centreline
    double largest_curvature = 0;  // of a centreline [1/mm]
    std::string sharpest;          // branch that holds it; empty = none bends
    double sharpest_radius = 0;    // of the lumen there [mm]
};

/// Curvature is that of the circle through a sample and the points one lumen radius before and behind it
/// along its branch: a wire can cut across anything shorter.
LumenDemand demand_of(const anatomy::Anatomy&);

/// Whether the vessels can wind up the whole shaft of a device by more than 2°.
bool device_winds_up(const Device&, const LumenDemand&);

struct ModelChoice {
    double segment_length = 0;         // λ [mm]
    std::string segment_reason;        // one sentence
    WallModel wall = WallModel::Auto;  // that is left where no smooth wall is possible
    std::string wall_reason;           // one sentence
    bool winds_up = false;             // whether the wire's torsion shows
    bool held_back = false;            // and whether friction on its shaft does
    std::string torsion_reason;        // one sentence; empty for a wire without torsional rigidity
    std::string held_reason;           // continues it where the shaft is held back
    LumenDemand demand;
};

/// λ is the longest segment that sags by no more than the tolerance [mm] from the sharpest bend of the
/// vessels and of the wire's unloaded tip, and is no longer than the smallest radius; it is within 0.2 to 5
/// mm, and the curved tip is a whole number of segments. The wall is in closed form where `closed_form` says
/// there is one, else a distance field where its grid resolves the narrowest vessel and fits in memory;
/// `thickest` is the radius of the thickest device [mm], 0 = the wire.
/// A shaft winds up where the torque of the sharpest bend on the curved tip twists it by more than 2°. It is
/// held back where friction in that bend does so.
ModelChoice choose_model(const anatomy::Anatomy&, const Device& wire, double curve_tolerance,
                         bool closed_form, double thickest = 0);

}  // namespace scenario
