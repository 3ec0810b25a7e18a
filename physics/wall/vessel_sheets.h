#pragma once
/// Which walls can be seen from a place in the vessels, measured along the vessels: this keeps apart two
/// vessels that nearly touch, or the two limbs of a tight bend.

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "physics/geometry/centreline_tree.h"

namespace physics {

using namespace geometry;

/// A sheet is a run of stations along one branch that comes nowhere near itself. Each has a distance field of
/// its own, so that the fields of close vessels lie over one another like sheets.
struct SheetMap {
    std::vector<int> sheet_of;              // of each station
    std::vector<std::vector<int>> entries;  // of each station: of every other branch that it sees, the
                                            // station nearest along the vessels

    /// The station for x, which is out of its own one's ball: one of another branch that is seen from there,
    /// where x is in its ball or no more than an eighth of the radius out of it, and nearer to it by a
    /// quarter than to its own; else its own. So a joint that was kept in its vessel past a fork, while it
    /// went into the other one, is found there.
    int gone_over(const CentrelineTree&, const Vec3& x, int own) const;
};

/// What fields are made by.
struct VesselSheets {
    SheetMap map;
    std::vector<std::vector<int>> stations;  // of each sheet, consecutive
    std::vector<std::vector<int>> seen;      // of each station: the stations whose wall it sees, ascending
    std::vector<std::vector<int>> ends;      // of each station: the open ends it sees
};

/// A station sees another when the way between them along the vessels is at most 2 (r + r'): enough for the
/// wall nearest to any point of the lumen, and for both sides of a carina. Walls that do not see one another
/// belong to different sheets when they are closer than near(radius of the wider vessel) [mm], which grows
/// with that radius.
VesselSheets vessel_sheets(const CentrelineTree&, const std::function<double(double radius)>& near);

}  // namespace physics
