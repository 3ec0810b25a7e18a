#pragma once
/// Lines of straight pieces: vessels' centrelines, wires, paths.

#include <algorithm>
#include <span>
#include <vector>

#include "physics/geometry/vec.h"

namespace geometry {

/// Way along a centreline: how far, and how it changes with the point.
struct VesselWay {
    double way = 0;                // from the centreline's start [mm]
    Vec3 gradient = Vec3::Zero();  // ∇ of it [-]
};

double length_of(std::span<const Vec3> points);  // [mm]

/// Points about `step` [mm] apart along a line, which has a point or more; the first and the last stay.
Polyline resampled(const Polyline&, double step);

/// Of the way from a to b, 0 to 1, the share at the point of it closest to x. The two differ.
inline double closest_share(const Vec3& a, const Vec3& b, const Vec3& x) {
    const Vec3 ab = b - a;
    return std::clamp((x - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
}

/// Ways of a centreline's points, the first at `start` [mm].
std::vector<double> ways_along(std::span<const Vec3> points, double start = 0);

/// The way at x, by planes across the centreline at its points: unlike that of the closest point it has no
/// jumps where the vessel bends. `near` is a point close to x; beyond its ends the centreline has no more
/// way.
VesselWay vessel_way(std::span<const Vec3> points, std::span<const double> ways, int near, const Vec3& x);

}  // namespace geometry
