#pragma once
/// Questions about the surface of a triangle mesh: its edges, its boundary, the volume it holds.

#include <span>
#include <string>
#include <vector>

#include "physics/geometry/vec.h"

namespace geometry {

/// A closed chain of boundary edges, ordered as a cap needs it: a fan from its centroid to (loop[i],
/// loop[i+1]) faces the same side as the mesh.
struct BoundaryLoop {
    std::vector<int> vertices;
    Vec3 centroid = Vec3::Zero();  // of the corners [mm]
};

/// The centroid of the rim as a line, independent of where its corners crowd [mm].
Vec3 rim_centre(const TriangleMesh&, const BoundaryLoop&);

struct Topology {
    std::vector<BoundaryLoop> loops;
    int boundary_edges = 0;      // with one triangle
    int non_manifold_edges = 0;  // with three or more triangles, or with two that disagree about outside
    int degenerate_triangles = 0;
};

Topology topology(const TriangleMesh&);

/// For each vertex the first one of the mesh with equal coordinates (bit for bit, -0 being 0).
std::vector<int> first_at_place(std::span<const Vec3> vertices);

/// Vertices with equal coordinates become one, as first_at_place() compares them; triangles that collapse are
/// dropped. The triangles refer to vertices of the mesh.
TriangleMesh welded(const TriangleMesh&);

/// The mesh with every boundary loop closed by a fan from its centroid.
TriangleMesh capped(const TriangleMesh&, const std::vector<BoundaryLoop>&);

/// Volume of a closed mesh; positive when its normals point out [mm³].
double signed_volume(const TriangleMesh&);

}  // namespace geometry
