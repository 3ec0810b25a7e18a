#pragma once
/// Turns a vessel tree into an anatomy.

#include <functional>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/grow/implicit_lumen.h"
#include "engine/anatomy/grow/vessel_tree.h"

namespace anatomy {

struct GeneratorOptions {
    /// Cells per radius of the smallest vessel, for the grid that finds the surface: the most, unless the
    /// surface then passes through more than `many_cells` cells; never fewer than the fewest.
    double most_cells_per_radius = 3, fewest_cells_per_radius = 2, many_cells = 200e3;
    int threads = 2;  // the anatomy has the same bits for any number
    std::function<void(double part, const char* what)> progress;
};

/// The edge of a cell of the grid that finds the surface [mm].
double grid_cell(const VesselTree&, const GeneratorOptions& = {});

/// The lumen as a closed surface, before its ends are cut open.
struct ClosedLumen {
    ImplicitLumen implicit;
    geometry::TriangleMesh mesh;
};
ClosedLumen closed_surface(const VesselTree&, const GeneratorOptions& = {});

/// Generates lumen, centrelines, ends and targets. An end's plane passes through the second-to-last sample of
/// its centreline; ends are named BRANCH.in and BRANCH.out. Throws InputError for a spec that cannot be grown
/// or does not give a usable anatomy.
Anatomy generate(const VesselTreeSpec&, const GeneratorOptions& = {});
/// The last step of that, from the tree that the spec grows to and its surface.
Anatomy cut_open(const VesselTreeSpec&, const VesselTree&, const ClosedLumen&);

/// The spec's targets, but those beyond an occlusion, in place of those that the anatomy has; its branches
/// are the tree's.
void place_targets(Anatomy&, const VesselTreeSpec&, const VesselTree&);

}  // namespace anatomy
