#pragma once
/// Second-order terms of the energy of a whole wire, as the stages of the Riccati recursion.

#include <vector>

#include "physics/guidewire.h"
#include "physics/riccati.h"
#include "physics/wall.h"

namespace physics {

struct NewtonTerms {
    int first = 1;                     // segment that the window starts with; what lies proximal stands still
    bool twist = false;                // the rest shape is curved somewhere
    std::vector<RiccatiStage> stages;  // segments 1…N
    std::vector<Vec2> gradient;        // dU/dα per stage [N·mm]
    double relative_gradient = 0;  // largest |gradient| over C of the segment's proximal joint [-]: window
    double proximal_gradient = 0;  // and the same proximal of the window
    Vec3 push = Vec3::Zero();  // Σ of the forces of wall and load on the wire, reversed: what the introducer
                               // holds [N]
    double torque = 0;         // dU/droll: what the hub is held against [N·mm]

    std::span<RiccatiStage> window() { return std::span(stages).subspan(first - 1); }
    /// Of a stage, over C of its segment's proximal joint [-].
    double relative(int stage) const { return gradient[stage].norm() * inverse_spring[stage]; }
    std::vector<double> inverse_spring;  // 1/C of the joint proximal of each segment [1/N·mm]
};

/// Gradient and Hessian blocks of bending (Eq. 1, with rest directions), load and wall (Eq. 9, with the
/// wall's curvature) in the planes ⟂ u_j, u turned by u ← (u + Tα)/|u + Tα|. Exact but for terms of the twist
/// that are of the order of torque times bend. `directors` as from physics::directors where the tip is
/// curved. Stages proximal of `first` are taken as they stand from the last call, and only their gradient
/// answers to the forces and the torque from the window; without `proximal` it does not, and push and torque
/// are those of the window alone. Allocates on growth only.
void assemble(const Guidewire&, std::span<const WallContact>, const std::vector<Vec3>& directors, int first,
              NewtonTerms&, bool proximal = true);

/// The sums from the tip alone: gradients, axial forces and what the introducer holds, of stages that
/// assemble() has made.
void sum_from_tip(const Guidewire&, NewtonTerms&);

}  // namespace physics
