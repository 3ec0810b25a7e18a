#pragma once
/// The shaft between a hand and the valve: it sags under its weight, bows under a push, and twists.

#include "physics/geometry/state.h"

namespace physics {

using namespace geometry;

/// A shaft of `length`, clamped by the hand and by the valve. Its weight bends it down by
///     a₀ = w L⁴/(384 EI);
/// a push P bows it to a₀/(1 − P/P_c), and what it is then shorter across,
///     b = (π²/4L) a₀² (1/(1 − P/P_c)² − 1),
/// the hand feeds without the device going in (Timoshenko and Gere, Theory of Elastic Stability, 1961, §1.11,
/// with the shape (1 − cos 2πx/L)/2). Past P_c the shaft bears a little more, P/P_c = 1 + Δ/2 + 9Δ²/32 with
/// Δ = b/L, which is Euler's elastica to second order in Δ. Both together are one law P(b), which rises
/// everywhere.
struct OutsideShaft {
    double length = 100;  // L, from hand to valve [mm]
    double critical = 1;  // P_c at this length [N]
    double sag = 0.01;    // a₀ > 0 [mm]
    /// What the hand has fed that has not gone in; < 0 where a pull straightens the sag [mm].
    double bow = 0;

    /// How far the shaft can bow before it folds or the hand slips off it [mm].
    double most_bow() const { return 0.4 * length; }
    /// Push at a bow, and its slope [N], [N/mm]. The bow is above that of a straight shaft, −π²a₀²/4L.
    double push_at(double bow) const;
    double stiffness_at(double bow) const;
    /// The bow under a push [mm].
    double bow_at(double push) const;
    /// How far the shaft stands off its line at its middle [mm].
    double height() const;

    void state(StateStream& s) { s(length, critical, sag, bow); }
};

/// P_c of a shaft clamped in hand and valve: Euler's 4π²EI/L² [N].
double euler_force(double rigidity, double length);

}  // namespace physics
