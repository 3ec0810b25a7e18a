#pragma once
/// What the study of devices measures on a chain: shafts that twist segment by segment, against closed forms,
/// and the work of the hand, against what becomes of it.

#include <array>
#include <string>
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

/// What lets a shaft twist.
enum class WindUp { None, Whole, Segments };
const char* name_of(WindUp);

/// One device of a chain moved by small steps with the others held.
struct Balance {
    int devices = 1;  // on the chain: a wire, in a catheter, in a micro-catheter in a catheter
    double friction = 0;
    WindUp windup = WindUp::None;
    int moved = 0;                          // index of the device
    std::string motion;                     // in, turned or out
    double work = 0, gained = 0, loss = 0;  // of the hand; of the energy; by friction [N·mm]
    double traffic = 0;   // Σ over steps of the larger of |work| and |gained| + loss [N·mm]
    double missing = 0;   // Σ over steps of |work − gained − loss| [N·mm]
    int not_at_rest = 0;  // steps
    double off() const { return missing / traffic; }
};

/// Each device of a chain in a bent vessel, fed in by 10 mm, turned by 40° and drawn back. Work is summed by
/// the trapezoidal rule: where the push jumps, as where an end passes a joint that touches, it is off by the
/// jump times half a step.
std::vector<Balance> energy_balances(int devices, double friction, WindUp);

}  // namespace studies
