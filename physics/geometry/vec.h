#pragma once
/// Plain geometric data shared by physics and render. Lengths in mm; axes as in DICOM (+x patient left,
/// +y posterior, +z head).

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace geometry {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

constexpr double degree = std::numbers::pi / 180.0;  // [rad]

using Polyline = std::vector<Vec3>;  // points [mm], in order

/// Indexed triangles; counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<Vec3> vertices;                 // [mm]
    std::vector<std::array<int, 3>> triangles;  // indices into vertices
};

/// Unit vectors ⟂ u and each other, a deterministic function of the unit vector u.
inline void tangent_basis(const Vec3& u, Vec3& a, Vec3& b) {
    // Start from the axis that u is farthest from.
    int axis = 0;
    if (std::abs(u[1]) < std::abs(u[axis])) axis = 1;
    if (std::abs(u[2]) < std::abs(u[axis])) axis = 2;
    a = u.cross(Vec3::Unit(axis)).normalized();
    b = u.cross(a);
}

}  // namespace geometry
