#pragma once
/// Turns a lumen's surface, as scanners and programs produce it, into one that a wall can be built from.

#include <string>
#include <vector>

#include "engine/anatomy/import/mesh_cut.h"

namespace anatomy {

/// One observation about an anatomy.
struct Finding {
    enum class Kind { Noted, Mended, Warned };
    /// Of the paragraph that sums up an import; most findings are not in it.
    enum class Topic { Other, Axes, Removed, Smoothed, Ends, Names };
    Kind kind = Kind::Noted;
    std::string text;
    Topic topic = Topic::Other;
};
/// "mended: …", "note: …" for a warning, "found: …".
std::string text_of(const Finding&);
/// What was taken and changed: a paragraph of the findings with a topic, which says of each topic when there
/// was nothing.
std::string summary_of(const std::vector<Finding>&);

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
