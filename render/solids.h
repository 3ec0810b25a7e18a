#pragma once
/// Closed solids to build anatomy from.

#include <functional>
#include <vector>

#include "physics/geometry.h"

namespace render {

/// A cross-section: points centre + a·|cos|^(2/n)·u + b·|sin|^(2/n)·v of a superellipse. n = 2 is an ellipse,
/// larger is boxier.
struct Ring {
    physics::Vec3 centre;                      // [mm]
    physics::Vec3 u = physics::Vec3::UnitX();  // unit; u × v points along the solid
    physics::Vec3 v = physics::Vec3::UnitY();  // unit
    double a = 1.0;                            // half-axis along u [mm]
    double b = 1.0;                            // half-axis along v [mm]
    double exponent = 2.0;                     // n [-]
};

/// A skin over the rings in order, closed by flat lids; outward triangles. At least two rings, `around` ≥ 3
/// points.
physics::TriangleMesh loft(const std::vector<Ring>&, int around);

/// The same over rings of points that are given: all of one length, in the same sense around.
physics::TriangleMesh loft(const std::vector<physics::Polyline>& rings);

/// Tube of an elliptic section along a path; `u` is the direction of half-axis a, made perpendicular to the
/// path. `a` and `b` give one value for each point [mm].
physics::TriangleMesh tube(const physics::Polyline& path, const physics::Vec3& u,
                           const std::vector<double>& a, const std::vector<double>& b, int around = 20);

/// Half-axes along x, y and z [mm].
physics::TriangleMesh ellipsoid(const physics::Vec3& centre, const physics::Vec3& half_axes, int around = 28);

/// The solid whose surface stands `radius(direction)` from its centre [mm], in every unit direction.
physics::TriangleMesh star(const physics::Vec3& centre,
                           const std::function<double(const physics::Vec3&)>& radius, int around = 48);

/// Adds the triangles of `other`.
void append(physics::TriangleMesh& mesh, const physics::TriangleMesh& other);

/// The same surface with every triangle cut into four.
physics::TriangleMesh subdivided(const physics::TriangleMesh&);

/// Enclosed volume, positive for outward triangles [mm³].
double signed_volume(const physics::TriangleMesh&);

}  // namespace render
