#pragma once
/// What surface nets (Gibson 1998) of any grid share: one vertex in each cell that the surface passes
/// through, and two triangles about each edge that it crosses.

#include <array>
#include <utility>

#include "physics/geometry/vec.h"

namespace geometry {

/// Places where a surface crosses the edges of a cell.
struct Crossings {
    Vec3 sum = Vec3::Zero();  // from the cell's first corner [cells]
    int count = 0;
};

/// `value(c)`: negative inside, at corner c = x + 2y + 4z.
template <class Value>
Crossings crossings_of(const Value& value) {
    Crossings found;
    for (int c = 0; c < 8; ++c) {
        for (int axis = 0; axis < 3; ++axis) {
            if (c >> axis & 1) continue;
            const auto a = value(c), b = value(c | 1 << axis);
            if ((a < 0) == (b < 0)) continue;
            Vec3 place(c & 1, c >> 1 & 1, c >> 2);
            place[axis] += a / (a - b);
            found.sum += place;
            ++found.count;
        }
    }
    return found;
}

/// Vertices of the cells about an edge, right-handed about it; `outward`: along the edge. Cut along the
/// shorter diagonal; what is left of a triangle whose vertices were merged is left out.
inline void add_quad(TriangleMesh& mesh, std::array<int, 4> quad, bool outward) {
    if (!outward) std::swap(quad[1], quad[3]);
    const auto length = [&](int a, int b) {
        return (mesh.vertices[quad[a]] - mesh.vertices[quad[b]]).squaredNorm();
    };
    const int first = length(0, 2) <= length(1, 3) ? 0 : 1;
    const auto add = [&](int k, int l) {
        const std::array<int, 3> corners = {quad[first], quad[(first + k) % 4], quad[(first + l) % 4]};
        if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
            mesh.triangles.push_back(corners);
    };
    add(1, 2);
    add(2, 3);
}

}  // namespace geometry
