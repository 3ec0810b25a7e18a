#pragma once
/// How stiff a wall is along its vessel: the same everywhere, or the Fourier profile of Eq. 41.

#include <span>
#include <vector>

#include "physics/geometry/polyline.h"
#include "physics/wall/wall.h"

namespace physics {

/// K(s) = k + Σ_g k_g cos(g π s/L + φ_g), s the way along the vessel [mm]; the paper counts s in its Ω pieces
/// of artery.
class WallStiffness {
public:
    /// k_g [N/mm] and φ_g [rad] of one term; the first term has g = 1.
    struct Term {
        double amplitude = 0, phase = 0;
    };

    /// The same everywhere, k > 0 [N/mm]: a number converts to a WallStiffness.
    /// Throws std::invalid_argument when it is not positive and finite.
    WallStiffness(double stiffness) : WallStiffness(stiffness, 1, {}) {}
    /// Eq. 41 over `length` = L > 0 [mm]; beyond it the stiffness stays as at the ends. Throws
    /// std::invalid_argument when a number is not finite or when k is no larger than Σ|k_g|, so that the
    /// stiffness might not be positive.
    WallStiffness(double mean, double length, std::vector<Term> terms);

    bool uniform() const { return terms_.empty(); }
    double mean() const { return mean_; }          // k [N/mm]
    double at(double way) const;                   // K [N/mm]
    double slope(double way) const;                // dK/ds, 0 beyond the ends [N/mm²]
    double average(double from, double to) const;  // of K over a way of some length, in closed form [N/mm]
    /// Sets the stiffness of a contact there and its gradient.
    void apply(const VesselWay& at, WallContact&) const;

private:
    double mean_, length_;
    std::vector<Term> terms_;
};

}  // namespace physics
