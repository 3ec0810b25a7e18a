#pragma once
/// What of the vessels and devices the X-ray image would show.

#include "engine/exercise/simulation.h"

namespace exercise {

/// Whether a place in the vessels' frame, moved as they are now, projects into the field that the collimator
/// leaves open.
bool in_open_field(const Simulation&, const geometry::Vec3&);

/// Where the table would have to stand for the place to be at the isocentre: the arguments of `table` [mm].
geometry::Vec3 table_to_show(const Simulation&, const geometry::Vec3&);

}  // namespace exercise
