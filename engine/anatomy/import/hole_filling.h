#pragma once
/// Fills a hole of a surface with triangles.

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "physics/geometry/mesh_topology.h"

namespace anatomy {

/// The edges of a mesh, to keep patches from using one a third time.
class EdgeSet {
public:
    explicit EdgeSet(const geometry::TriangleMesh&);
    bool holds(int a, int b) const { return edges_.contains(key(a, b)); }
    void add(int a, int b) { edges_.insert(key(a, b)); }

private:
    static std::uint64_t key(int a, int b) {
        return static_cast<std::uint64_t>(a < b ? a : b) << 32 | static_cast<std::uint32_t>(a < b ? b : a);
    }
    std::unordered_set<std::uint64_t> edges_;
};

/// Closes the hole by the triangulation of its rim with the least area, or by a fan from its centroid where
/// the rim is long or every triangulation would reuse an edge of the mesh.
void fill_hole(geometry::TriangleMesh&, EdgeSet&, const geometry::BoundaryLoop&);

}  // namespace anatomy
