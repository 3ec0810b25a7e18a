#pragma once
/// How stiff a wall is along its vessel: the same everywhere, or the Fourier profile of Eq. 41.

#include <span>
#include <vector>

#include "physics/wall.h"

namespace physics {

/// Way along a centreline: how far, and how it changes with the point.
struct VesselWay {
    double way = 0;                // from the centreline's start [mm]
    Vec3 gradient = Vec3::Zero();  // ∇ of it [-]
};

/// K(s) = k + Σ_g k_g cos(g π s/L + φ_g), s the way along the vessel [mm]; the paper counts s in its Ω pieces
/// of artery.
class WallStiffness {
public:
    /// k_g [N/mm] and φ_g [rad] of one term; the first term has g = 1.
    struct Term {
        double amplitude = 0, phase = 0;
    };

    /// The same everywhere, k > 0 [N/mm]: a number will do wherever a WallStiffness is asked for.
    /// Throws std::invalid_argument when it is not positive and finite.
    WallStiffness(double stiffness) : WallStiffness(stiffness, 1, {}) {}
    /// Eq. 41 over `length` = L > 0 [mm], and beyond it as at its ends. Throws std::invalid_argument when a
    /// number is not finite or when k is no larger than Σ|k_g|, so that the wall might not be stiff.
    WallStiffness(double mean, double length, std::vector<Term> terms);

    bool uniform() const { return terms_.empty(); }
    double mean() const { return mean_; }          // k [N/mm]
    double at(double way) const;                   // K [N/mm]
    double slope(double way) const;                // dK/ds, 0 beyond the ends [N/mm²]
    double average(double from, double to) const;  // of K over a way of some length, in closed form [N/mm]
    /// Stiffness of a contact there and its gradient.
    void apply(const VesselWay& at, WallContact&) const;

private:
    double mean_, length_;
    std::vector<Term> terms_;
};

/// Ways of a centreline's points, the first at `start` [mm].
std::vector<double> ways_along(std::span<const Vec3> points, double start = 0);

/// The way at x, by planes across the centreline at its points: unlike that of the closest point it has no
/// jumps where the vessel bends. `near` is a point close to x; beyond its ends the centreline has no more
/// way.
VesselWay vessel_way(std::span<const Vec3> points, std::span<const double> ways, int near, const Vec3& x);

}  // namespace physics
