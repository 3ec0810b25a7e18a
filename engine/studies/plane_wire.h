#pragma once
/// The exact curve of a wire in a plane, from the differential equations of an inextensible rod, for chains
/// of segments to be compared with. Uses nothing of physics/.

#include <functional>
#include <vector>

#include "physics/geometry/vec.h"

namespace studies {

/// The depth of a point in a wall, > 0 outside the lumen [mm], and the unit normal out of the lumen.
struct PlaneContact {
    double penetration = 0;
    geometry::Vec2 normal = geometry::Vec2::Zero();
};

/// A wire clamped at the origin, straight when unloaded, whose tip alone meets a wall:
///   x′ = cos φ, y′ = sin φ, φ′ = M/EI, M′ = n_x sin φ − n_y cos φ, n′ = −q,
/// n being the force of what is distal on what is proximal. At the tip M = 0 and n = −K pen ν, ν the wall's
/// normal.
struct PlaneWire {
    double rigidity = 50, length = 0;                              // EI [N·mm²], L [mm]
    double stiffer_length = 0, stiffer_rigidity = 0;               // EI from the clamp on to here
    double angle = 0;                                              // φ at the clamp [rad]
    geometry::Vec2 load = geometry::Vec2::Zero();                  // q [N/mm]
    std::function<PlaneContact(const geometry::Vec2&)> wall = {};  // empty = none
    double tip_stiffness = 0;                                      // K [N/mm]
};

struct PlanePoint {
    geometry::Vec2 place = geometry::Vec2::Zero();  // [mm]
    double angle = 0, moment = 0;                   // φ [rad], M [N·mm]
    geometry::Vec2 force = geometry::Vec2::Zero();  // n [N]
};

struct PlaneCurve {
    std::vector<PlanePoint> points;  // equally far apart along the wire, from the clamp to the tip
    double energy = 0;               // of bending, wall and load [N·mm]
    double residual = 0;             // at the tip, of M [N·mm] or n [N]
    double step_error = 0;           // largest motion of any point when steps are halved [mm]
};

/// Shoots from a guess of M and n at the clamp: Newton's method on the conditions at the tip, Runge and
/// Kutta's of fourth order between the points.
PlaneCurve exact_curve(const PlaneWire&, int intervals, double moment, const geometry::Vec2& force);

}  // namespace studies
