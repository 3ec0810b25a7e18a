#pragma once
/// Shafts that twist segment by segment, against closed forms.

#include <array>
#include <vector>

namespace studies {

/// A straight wire of length ℓ pressed down on all its length by q, in a narrow tube: friction holds it, and
/// its end follows the hub less μ q r ℓ²/2GJ. It climbs the tube's wall to the angle of friction, so that q
/// is the load over √(1 + μ²).
struct HeldShaft {
    double friction = 0;
    std::vector<std::array<double, 2>> curve;  // hub, end [deg]
    double measured = 0, exact = 0;            // lag of the end [deg]
    double torque = 0, exact_torque = 0;       // at the hub: μ q r ℓ [N·mm]
    double work = 0, gained = 0, loss = 0;     // of the hand, and where it went [N·mm]
};
HeldShaft held_shaft(double friction);

/// A rod of uniform rest curvature κ₀ and length L in a tube of curvature κ: GJ ψ'' = EI κ₀ κ sin ψ with ψ(0)
/// the hub's angle and ψ'(L) = 0. It turns smoothly where L √(EI κ₀ κ/GJ) < π/2, and else snaps: the
/// stability condition of concentric-tube robots.
struct CurvedRod {
    double reach = 0;                          // L √(EI κ₀ κ/GJ)
    std::vector<std::array<double, 3>> curve;  // hub, tip, hub at which the equation has that tip [deg]
    double largest_step = 0;                   // of the tip in a step of the hub [deg]
    double snap = 0, exact_snap = 0;  // hub's angle at the largest step, and where the equation folds [deg]
    double off = 0;                   // largest |hub − equation's| before any snap, up to 180 without [deg]
    int unconverged = 0;
};
constexpr double rod_step = 5;  // of the hub [deg]
/// Below the limit and above it at lengths of 40 and 60 mm.
CurvedRod curved_rod(double length);

/// Two free tubes of one curvature κ, one in the other, the outer's hub turned against the inner's: their
/// angle θ obeys θ'' = c sin θ, c = κ² EI₁EI₂/(EI₁ + EI₂) (1/GJ₁ + 1/GJ₂), and they snap where L√c > π/2
/// (P. Dupont et al., Design and control of concentric-tube robots, 2010). Their largest step is that of the
/// angle at the distal end.
constexpr double tubes_step = 1;  // of the hub [deg]
/// Tubes of this L√c.
CurvedRod concentric_tubes(double reach);

}  // namespace studies
