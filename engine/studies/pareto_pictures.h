#pragma once
/// Pictures of the study of speed against accuracy.

#include <string>
#include <vector>

#include "engine/io/plot.h"
#include "engine/io/table.h"
#include "engine/studies/pareto_methods.h"

namespace studies {

constexpr double frame_ms = 1000.0 / 60;  // of a display of 60 frames a second

/// The front page of the studies: time of a push against error at rest, all tubes together, from
/// pareto_curves.csv. `floors` [mm] are those of the rivals, NaN for others.
io::Plot speed_plot(const std::vector<ParetoMethod>&, const io::Table& curves,
                    const std::vector<double>& floors);
/// The same by tube.
io::Plot tubes_plot(const std::vector<ParetoVessel>&, const std::vector<ParetoMethod>&);
/// From the centreline, from pareto.csv.
io::Plot centreline_plot(const std::vector<ParetoVessel>&, const std::vector<ParetoMethod>&);

}  // namespace studies
