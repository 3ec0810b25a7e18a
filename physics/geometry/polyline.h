#pragma once
/// Lines of straight pieces: vessels' centrelines, wires, paths.

#include <span>
#include <vector>

#include "physics/geometry/vec.h"

namespace geometry {

/// Way along a centreline: how far, and how it changes with the point.
struct VesselWay {
    double way = 0;                // from the centreline's start [mm]
    Vec3 gradient = Vec3::Zero();  // ∇ of it [-]
};

/// Ways of a centreline's points, the first at `start` [mm].
std::vector<double> ways_along(std::span<const Vec3> points, double start = 0);

/// The way at x, by planes across the centreline at its points: unlike that of the closest point it has no
/// jumps where the vessel bends. `near` is a point close to x; beyond its ends the centreline has no more
/// way.
VesselWay vessel_way(std::span<const Vec3> points, std::span<const double> ways, int near, const Vec3& x);

}  // namespace geometry
