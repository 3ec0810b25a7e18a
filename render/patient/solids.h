#pragma once
/// Closed solids to build anatomy from.

#include <functional>
#include <vector>

#include "physics/geometry/random.h"
#include "physics/geometry/vec.h"

namespace render {

using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

/// A cross-section: points centre + a·|cos|^(2/n)·u + b·|sin|^(2/n)·v of a superellipse. n = 2 is an ellipse,
/// larger is boxier.
struct Ring {
    geometry::Vec3 centre;                       // [mm]
    geometry::Vec3 u = geometry::Vec3::UnitX();  // unit; u × v points along the solid
    geometry::Vec3 v = geometry::Vec3::UnitY();  // unit
    double a = 1.0;                              // half-axis along u [mm]
    double b = 1.0;                              // half-axis along v [mm]
    double exponent = 2.0;                       // n [-]
};

/// A skin over the rings in order, closed by flat lids; triangles face outward. Needs at least two rings and
/// `around` ≥ 3 points.
geometry::TriangleMesh loft(const std::vector<Ring>&, int around);

/// The same over given rings of points: all of one length, in the same sense around.
geometry::TriangleMesh loft(const std::vector<geometry::Polyline>& rings);

/// Tube of an elliptic section along a path; `u` is the direction of half-axis a, made perpendicular to the
/// path. `a` and `b` give one value for each point [mm].
geometry::TriangleMesh tube(const geometry::Polyline& path, const geometry::Vec3& u,
                            const std::vector<double>& a, const std::vector<double>& b, int around = 20);

/// Half-axes along x, y and z [mm].
geometry::TriangleMesh ellipsoid(const geometry::Vec3& centre, const geometry::Vec3& half_axes,
                                 int around = 28);

/// The solid whose surface lies at the distance `radius(direction)` from its centre [mm], for every unit
/// direction.
geometry::TriangleMesh star(const geometry::Vec3& centre,
                            const std::function<double(const geometry::Vec3&)>& radius, int around = 48);

/// Calls `draw(at, inward)` for places on a closed surface that lie as chance has it, `per_area` of them for
/// each mm².
void scatter(const geometry::TriangleMesh&, double per_area, geometry::Random&,
             const std::function<void(const geometry::Vec3& at, const geometry::Vec3& inward)>& draw);

/// Adds the triangles of `other`.
void append(geometry::TriangleMesh& mesh, const geometry::TriangleMesh& other);

/// The same surface with every triangle cut into four.
geometry::TriangleMesh subdivided(const geometry::TriangleMesh&);

}  // namespace render
