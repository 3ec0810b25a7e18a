#pragma once
/// Lines of straight pieces: vessels' centrelines, wires, paths.

#include <algorithm>
#include <span>
#include <vector>

#include "physics/geometry/vec.h"

namespace geometry {

/// Arc length along a centreline and its change with the point.
struct CentrelineCoordinate {
    double arc = 0;                // from the centreline's start [mm]
    Vec3 gradient = Vec3::Zero();  // ∇ of it [-]
};

double length_of(std::span<const Vec3> points);  // [mm]

/// Points about `step` [mm] apart along a line of one point or more; the first and the last point stay.
Polyline resampled(const Polyline&, double step);

/// Fraction of the way from a to b, 0 to 1, at which the line is closest to x. a and b must differ.
inline double closest_fraction(const Vec3& a, const Vec3& b, const Vec3& x) {
    const Vec3 ab = b - a;
    return std::clamp((x - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
}

/// Arc lengths of a centreline's points, the first at `start` [mm].
std::vector<double> arc_lengths(std::span<const Vec3> points, double start = 0);

/// The arc length at x, measured by planes across the centreline at its points: unlike that of the closest
/// point it does not jump where the vessel bends. `near` is the index of a point close to x; beyond the
/// centreline's ends it no longer changes.
CentrelineCoordinate centreline_coordinate(std::span<const Vec3> points, std::span<const double> arcs,
                                           int near, const Vec3& x);

}  // namespace geometry
