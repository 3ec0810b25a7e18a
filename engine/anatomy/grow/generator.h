#pragma once
/// Vessel tree in, anatomy out.

#include <functional>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/grow/remesh.h"
#include "engine/anatomy/grow/vessel_tree.h"

namespace anatomy {

struct GeneratorOptions {
    /// For the grid that finds the surface, of the smallest vessel: the most, unless the surface then passes
    /// through more than many cells; never fewer than the fewest.
    double most_cells_per_radius = 3, fewest_cells_per_radius = 2, many_cells = 200e3;
    RemeshOptions remesh;
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

/// Lumen, centrelines, ends and targets. An end's plane goes through the last but one sample of its
/// centreline; ends are named BRANCH.in and BRANCH.out. Throws InputError for a spec that cannot be grown or
/// gives no usable anatomy.
Anatomy generate(const VesselTreeSpec&, const GeneratorOptions& = {});

}  // namespace anatomy
