#pragma once
/// Tables and pictures of the manipulations.

#include <span>
#include <vector>

#include "engine/io/plot.h"
#include "engine/io/table.h"
#include "engine/studies/hands_behaviours.h"

namespace studies {

/// Every sample, or of long courses some and all that jump: the device that the behaviour is about, and the
/// energies.
io::Table curve_table(std::span<const BehaviourRun>);
/// Where devices lie at the moments that were kept.
io::Table path_table(std::span<const BehaviourRun>);
/// Balls inscribed in the vessels, for an outline.
io::Table vessel_table(std::span<const BehaviourRun>);

/// A picture for each behaviour, and one of all sizes beside the published ranges.
std::vector<io::Plot> hand_plots(std::span<const BehaviourRun>);

}  // namespace studies
