#pragma once
/// Second-order terms of the energy of a whole wire, as the stages of the Riccati recursion.

#include <vector>

#include "physics/relax/riccati.h"
#include "physics/wall/wall.h"
#include "physics/wire/guidewire.h"

namespace physics {

/// A contact in the model: penetration = gap + normal·(x − x_accepted).
struct ContactPlane {
    double gap = 0, stiffness = 0;
    Vec3 normal = Vec3::Zero();
    double force = 0;  // in its second-order terms [N]

    void state(StateStream& s) { s(gap, stiffness, normal, force); }
};

/// Sums over everything distal of a segment.
struct DistalSums {
    double length = 0;          // whose load is felt [mm]
    Vec3 force = Vec3::Zero();  // of the wall on the wire, reversed [N]
    double torque = 0;          // [N·mm]
    double second_torque = 0;   // of it the second device's [N·mm]
    Vec2 slope = Vec2::Zero();  // of the joint between that segment and the next [N·mm]

    void state(StateStream& s) {
        s(length, force, torque, slope);
        if (!s.part(second_torque != 0, second_torque)) second_torque = 0;
    }
};

struct NewtonTerms {
    int first = 1;                     // segment that the window starts with; what lies proximal stands still
    bool twist = false;                // the rest shape is curved somewhere
    bool second = false;               // and that of a second device turns by itself
    bool each = false;                 // every segment twists by itself
    std::vector<RiccatiStage> stages;  // segments 1…N
    std::vector<Vec2> gradient;        // dU/dα per stage [N·mm]
    double relative_gradient = 0;      // in the window: largest |gradient| over C of the proximal joint [-]
    double proximal_gradient = 0;      // the same proximal of the window
    Vec3 push = Vec3::Zero();  // Σ of the forces of wall and load on the wire, reversed: what the introducer
                               // holds [N]
    double torque = 0;         // dU/droll: torque against which the hub is held [N·mm]
    double windup_stiffness = 0;  // Guidewire's [N·mm]
    /// Of each device of a chain; 0 = it does not wind up [N·mm].
    std::vector<double> device_stiffness;
    std::vector<TwistStage> twist_stages;  // segments 1…N, where each twists
    std::vector<double> twist_gradient;    // dU/dβ per stage [N·mm]
    Twist twists() const {
        return !twist ? Twist::None : each ? Twist::Each : second ? Twist::Two : Twist::One;
    }
    /// Torque of the window's bends on the frame of a chain's device.
    double device_torque(int device) const {
        if (!second) return base.torque;
        return device == 1 ? base.second_torque : base.torque - base.second_torque;
    }
    bool exact = true;  // the window's stages use the contacts' own forces in their second-order terms

    void state(StateStream& s) {
        s(first, twist, stages, gradient, relative_gradient, proximal_gradient, push, torque, exact,
          inverse_spring, base);
        if (!s.part(windup_stiffness != 0, windup_stiffness)) windup_stiffness = 0;
        if (!s.part(second || !device_stiffness.empty(), second, device_stiffness)) {
            second = false;
            device_stiffness.clear();
        }
        if (!s.part(each, each, twist_stages, twist_gradient)) {
            each = false;
            twist_stages.clear(), twist_gradient.clear();
        }
    }
    std::span<RiccatiStage> window() { return std::span(stages).subspan(first - 1); }
    std::span<const TwistStage> twist_window() const {
        return each ? std::span(twist_stages).subspan(first - 1) : std::span<const TwistStage>();
    }
    std::vector<double> inverse_spring;  // 1/C of the joint proximal of each segment [1/N·mm]
    DistalSums base;                     // from the window's most proximal segment on
};

/// Adds a grip's second-order terms at the accepted joint to its stage. Returns its drag, a gradient [N].
Vec3 add_grip(const Grip&, const Vec3& joint, RiccatiStage&);
/// A segment's own twist, and what its joint's grip has against its roll. Returns the grip's torque, a
/// gradient [N·mm].
double set_twist_stage(const Guidewire&, int segment, TwistStage&);

/// Gradient and Hessian blocks of bending (Eq. 1, with rest directions), load and wall (Eq. 9, with the
/// wall's curvature) in the planes ⟂ u_j, u turned by u ← (u + Tα)/|u + Tα|, of the window from `first` on.
/// Exact except for terms of the twist of the order of torque times bend. The same loop does
/// riccati_backward() over the window: the work of making a stage runs while the recursion waits for its own
/// results. `directors` are as from physics::directors where the tip is curved. The second-order terms of a
/// joint in touch use its plane's force, as do those of a joint that has left the wall, which then counts as
/// touching; `planes` (per joint) become the contacts'. `gains` are the window's. Push and torque are those
/// of the window alone. Allocates only to grow. `twist_gains` are the window's where each segment twists.
RiccatiReport assemble_and_solve(const Guidewire&, std::span<const WallContact>,
                                 const std::vector<Vec3>& directors, int first, double mu, double least_pivot,
                                 NewtonTerms&, std::span<ContactPlane> planes, std::span<RiccatiGain> gains,
                                 std::span<TwistGain> twist_gains = {});

/// Gradient proximal of the window, whose stages stand as the last call left them, and what the introducer
/// holds of the whole wire.
void sum_proximal(const Guidewire&, std::span<const WallContact>, NewtonTerms&);

}  // namespace physics
