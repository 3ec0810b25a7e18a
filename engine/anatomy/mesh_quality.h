#pragma once
/// The quality of a triangle mesh: its angles, its Euler characteristic, whether it intersects itself.

#include <utility>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

struct TriangleAngles {
    double least = 0;       // of all angles [rad]
    double percentile = 0;  // 1 % of the triangles have a smaller least angle [rad]
};
TriangleAngles smallest_angles(const geometry::TriangleMesh&);

/// Corners − edges + triangles: 2 for a closed surface without handles.
int euler_characteristic(const geometry::TriangleMesh&);

/// Pairs of triangles that share no corner and cross each other, in order.
std::vector<std::pair<int, int>> crossing_pairs(const geometry::TriangleMesh&);
int self_intersections(const geometry::TriangleMesh&);

}  // namespace anatomy
