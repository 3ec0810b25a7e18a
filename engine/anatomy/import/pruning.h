#pragma once
/// Cuts off the tree what no wire can enter.

#include <string>
#include <vector>

#include "engine/anatomy/import/lumen_tracing.h"

namespace anatomy {

struct Pruning {
    std::vector<std::string> lines;  // one for each branch that was cut: where, how thin, what is lost
    std::vector<int> closed;         // openings that lie beyond
    double length = 0;               // of all that was cut [mm]
};

/// Cuts every branch where its inscribed radius first falls below `least`, and drops the branches that leave
/// it beyond. A branch that would be no longer than the vessel it leaves is wide is dropped whole. The root
/// keeps its first sample.
Pruning prune_thin(TracedLumen&, double least);

}  // namespace anatomy
