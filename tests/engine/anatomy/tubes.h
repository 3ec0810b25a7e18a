#pragma once
/// Tubes in closed form that the importer's tests start from.

#include <cmath>
#include <numbers>

#include "physics/geometry/mesh_topology.h"

namespace test {

/// Open at both ends, facing out. From the origin along +x, then, with a bend, in an arc of that radius in
/// the xy plane, `length` along its axis.
inline geometry::TriangleMesh tube(double radius, double length, int around = 24, double bend = 0) {
    using geometry::Vec3;
    geometry::TriangleMesh mesh;
    const int along = static_cast<int>(std::ceil(length / (2 * std::numbers::pi * radius / around)));
    for (int i = 0; i <= along; ++i) {
        const double s = length * i / along, angle = bend > 0 ? s / bend : 0;
        const Vec3 centre =
            bend > 0 ? Vec3(bend * std::sin(angle), bend * (1 - std::cos(angle)), 0) : Vec3(s, 0, 0);
        const Vec3 across(-std::sin(angle), std::cos(angle), 0);
        for (int k = 0; k < around; ++k) {
            const double turn = 2 * std::numbers::pi * (k + 0.5 * (i % 2)) / around;
            mesh.vertices.push_back(centre +
                                    radius * (std::cos(turn) * across + std::sin(turn) * Vec3::UnitZ()));
        }
    }
    for (int i = 0; i < along; ++i) {
        for (int k = 0; k < around; ++k) {
            const int shift = i % 2, n = (k + 1) % around, low = i * around, high = low + around;
            if (shift == 0) {
                mesh.triangles.push_back({low + k, low + n, high + k});
                mesh.triangles.push_back({low + n, high + n, high + k});
            } else {
                mesh.triangles.push_back({low + k, high + n, high + k});
                mesh.triangles.push_back({low + k, low + n, high + n});
            }
        }
    }
    if (geometry::signed_volume(geometry::capped(mesh, geometry::topology(mesh).loops)) < 0)
        for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

inline void append(geometry::TriangleMesh& mesh, const geometry::TriangleMesh& more) {
    const int first = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), more.vertices.begin(), more.vertices.end());
    for (const auto& t : more.triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

}  // namespace test
