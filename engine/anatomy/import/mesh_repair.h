#pragma once
/// Turns a lumen's surface, as scanners and programs produce it, into one that a wall can be built from.

#include <string>
#include <vector>

#include "engine/anatomy/import/mesh_cut.h"

namespace anatomy {

/// One observation about an anatomy.
struct Finding {
    enum class Kind { Noted, Mended, Warned };
    Kind kind = Kind::Noted;
    std::string text;
};
/// "mended: …", "note: …" for a warning, "found: …".
std::string text_of(const Finding&);

struct RepairedLumen {
    geometry::TriangleMesh
        mesh;  // welded, outward, manifold, open at the ends only; single-precision corners
    std::vector<MeshOpening> ends;  // largest first
    std::vector<Finding> findings;
};

/// Welds corners closer than a millionth of the diagonal, drops degenerate and duplicate triangles, fins and
/// islands, turns all triangles outward, fills holes, takes off the flat caps of vessels and smooths the
/// steps of voxels. Throws InputError for a surface without an inside.
RepairedLumen repaired(const geometry::TriangleMesh&);

}  // namespace anatomy
