#pragma once
/// How stiff a wall is along its vessel: the same everywhere, or the Fourier profile of Eq. 41.

#include <cstdint>
#include <span>
#include <vector>

#include "physics/geometry/polyline.h"
#include "physics/wall/wall.h"

namespace physics {

/// K(s) = k + Σ_g k_g cos(g π s/L + φ_g), s the arc length along the vessel [mm]; the paper counts s in its Ω
/// pieces of artery.
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

    /// The same, of joints that stand for this length of the chain where their fraction of the wall is whole
    /// [mm]. Where nobody says, it is 1 mm. Throws std::invalid_argument when it is not positive and finite.
    WallStiffness per(double joint_length) const;
    double joint_length() const { return joint_length_; }

    bool uniform() const { return terms_.empty(); }
    double mean() const { return mean_; }      // k [N/mm]
    double length() const { return length_; }  // L [mm]
    std::span<const Term> terms() const { return terms_; }
    double at(double arc) const;                   // K [N/mm]
    double slope(double arc) const;                // dK/ds, 0 beyond the ends [N/mm²]
    double average(double from, double to) const;  // of K over a way of some length, in closed form [N/mm]
    /// Sets the stiffness of a contact there and its gradient.
    void apply(const CentrelineCoordinate& at, WallContact&) const;

private:
    double mean_, length_, joint_length_ = 1;
    std::vector<Term> terms_;
};

/// Eq. 41 before the wall's k and the vessel's length are known.
struct WallVariation {
    std::vector<WallStiffness::Term> terms;  // amplitudes k_g/k [-], phases [rad]
    double length = 0;  // L: way from the start of the root vessel, over which K varies; 0 = the whole [mm]

    /// Over `whole` where the variation has no length of its own [mm]. Terms of no amplitude are left out at
    /// the end of the list, so that a variation of nothing is a uniform wall. Throws as WallStiffness does.
    WallStiffness of(double mean, double whole) const;
    double sum() const;  // Σ|k_g|/k, which must stay below 1 for K to stay above 0 [-]

    void state(StateStream&);
};

inline constexpr int published_terms = 9;  // G of Eq. 41

/// The paper's draw (Section 3.5): k_g in [0, 2^−g k], φ_g in [0, 2π). Determined by the seed and the number
/// of the realisation alone, the same on every machine.
WallVariation drawn_variation(std::uint64_t seed, int terms = published_terms, int realisation = 0);

}  // namespace physics
