#pragma once
/// Newton step for all segments at once in O(N): the chain as an optimal-control problem, solved by a Riccati
/// recursion from the tip to the base and a rollout back. docs/solver.md derives it.
///
/// Stage j turns segment j by α_j in the plane ⟂ u_j. State after stage j: displacement δx_j of joint j, α_j,
/// and the turns ψ_f of the material frames of those devices that act on the chain, with
///   δx_j = δx_{j-1} + λ_j T_j α_j,    ψ_{f,j} = ψ_{f,j-1} + twist_prev·α_{j-1} + twist·α_j + β_{f,j},
/// β_{f,j} the twist of segment j of a device that twists segment by segment. The value function
///   V_j = ½δxPδx + δxP_xα + ½αP_aα + Σ_f ψ_f(v_f·δx + w_f·α + p_f) + ½Σ_fg ψ_f c_fg ψ_g + p·δx + p_a·α
/// is carried from j = N to 1.

#include <array>
#include <span>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "physics/wire/device.h"

namespace physics {

using namespace geometry;

using Mat2 = Eigen::Matrix2d;
using Mat32 = Eigen::Matrix<double, 3, 2>;
using Mat23 = Eigen::Matrix<double, 2, 3>;

/// Second-order model of segment j, its proximal joint j−1 and its distal joint j.
struct RiccatiStage {
    Mat32 basis = Mat32::Zero();  // T_j, orthonormal, ⟂ u_j
    double length = 0;            // λ_j [mm]
    double axial = 0;  // λ_j u_j·s_j: force of wall and load along the segment times its length [N·mm]
    Vec3 force = Vec3::Zero();      // f_j of the wall at joint j, a gradient [N]
    Mat3 stiffness = Mat3::Zero();  // H_j [N/mm]
    bool touches = false;           // force and stiffness are zero where false, and are not read
    // Bending at joint j−1: gradient and Hessian blocks with respect to α_{j-1} and α_j [N·mm]. A load on the
    // chain distal of there, whose force is constant, is part of `slope`.
    Vec2 slope_prev = Vec2::Zero(), slope = Vec2::Zero();
    Mat2 prev_prev = Mat2::Zero(), own = Mat2::Zero(), cross = Mat2::Zero();  // cross: α_{j-1}ᵀ · cross · α_j
    // Turn of all frames by the two turns of the joint: parallel transport [-].
    Vec2 twist_prev = Vec2::Zero(), twist = Vec2::Zero();

    void state(StateStream& s) {
        s(basis, length, axial, touches, slope_prev, slope, prev_prev, own, cross, twist_prev, twist, force,
          stiffness);
    }
};

/// What of a stage depends on one frame.
struct FrameStage {
    // Of the bend at joint j−1, with respect to ψ_{f,j-1}: gradient, Hessian, and crosswise with α_{j-1} and
    // α_j [N·mm].
    double slope = 0, curve = 0;
    Vec2 cross_prev = Vec2::Zero(), cross = Vec2::Zero();
    // Of the twist of segment j, where the frame twists segment by segment: κ(τβ + ½β²) [N·mm].
    double twist_stiffness = 0;  // κ; 0 = it does not
    double twist_slope = 0;      // κτ
    // Of the wall's grip on joint j with respect to ψ_{f,j}, and crosswise with δx_j [N·mm, N·mm, N].
    double grip_slope = 0, grip_grip = 0;
    Vec3 grip_cross = Vec3::Zero();

    void state(StateStream& s) {
        s(slope, curve, cross_prev, cross, twist_stiffness, twist_slope, grip_slope, grip_grip, grip_cross);
    }
};

constexpr double twist_arm = 1;  // by which the trust region weighs a turn of a material frame [mm]

/// [a b; b c]
struct SymmetricBlock {
    double a = 0, b = 0, c = 0;

    void state(StateStream& s) { s(a, b, c); }
};

/// α_j = step + from_x δx_{j-1} + from_prev α_{j-1} + Σ_f (FrameGain) from_frame ψ_{f,j-1}.
struct RiccatiGain {
    Vec2 step = Vec2::Zero();
    Mat23 from_x = Mat23::Zero();
    Mat2 from_prev = Mat2::Zero();
    SymmetricBlock inverse;  // minus the inverse Hessian block of α_j, all distal of it answering

    void state(StateStream& s) { s(step, from_x, from_prev, inverse); }
};

/// What a stage's answer to one frame is, and that frame's own twist of segment j,
///   β_f = step + from_x δx_j + from_turn α_j + Σ_g from_frame[g] ψ'_g,
/// ψ'_g the turn at segment j: for g ≤ f without that segment's own twist, for g > f with it.
struct FrameGain {
    Vec2 turn = Vec2::Zero();   // of α_j by ψ_{f,j-1}
    double step = 0, give = 0;  // give: −1 over the pivot [1/(N·mm)]
    Vec3 from_x = Vec3::Zero();
    Vec2 from_turn = Vec2::Zero();
    std::array<double, most_devices> from_frame = {};

    void state(StateStream& s) { s(turn, step, give, from_x, from_turn, from_frame); }
};

/// A segment that is fed more wire: joint j moves by `by` in addition to what the turns do [mm].
struct FedStage {
    int stage = -1;  // index into stages
    Vec3 by = Vec3::Zero();
};

/// The frames of the same segments as the stages and gains that they are given with: element j·count + f.
struct FrameStages {
    int count = 0;  // of frames
    std::span<const FrameStage> stages;
    /// Element (j·count + f)·count + g, g < f: Hessian of the joint by ψ_f and ψ_g; empty = none [N·mm].
    std::span<const double> mixed;
    std::span<FrameGain> gains;
};

using FrameVector = std::array<double, most_devices>;
using FrameMatrix = std::array<FrameVector, most_devices>;

struct RiccatiReport {
    int shifted = 0;  // pivots that were not positive definite and were shifted until they were
    // The most distal of them: its lower eigenvalue is the energy's own curvature along `direction` while
    // everything distal answers by its gains. `direction` leads down where the gradient vanishes.
    int stage = -1;                 // index into stages
    int frame = -1;                 // whose twist of that segment it was; −1 = it was a turn of the segment
    Vec2 direction = Vec2::Zero();  // unit
    // Slope and curvature by the frames' turns at the base, everything distal of it answering.
    FrameVector slope = {};
    FrameMatrix curve = {};

    void state(StateStream& s) { s(shifted, stage, frame, direction, slope, curve); }
};

/// Backward pass over stages 1…n (element 0 first). μ [N/mm²] adds μ λ_j to every joint's stiffness: a trust
/// region. A pivot that is not positive is mirrored, and is at least `least_pivot` and at least what rounding
/// leaves of its block. Gains may still overflow where many such pivots follow one another.
/// Equal to a dense factorisation of the same quadratic model; no pivot shifted at μ = 0 means that the
/// model's Hessian is positive definite: a strict local minimum where the gradient vanishes.
RiccatiReport riccati_backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                               std::span<RiccatiGain> gains, const FrameStages& = {});

/// Makes the gains' steps the answer to segments that change their length and to gradients that have changed,
/// to first order. `gains` are those of the same stages at μ = 0 before any gradient changed. The stages from
/// the tip to the most proximal fed one are processed again; for the others down to `first` this takes a
/// small part of a backward pass. With `anew` all stages are processed again, and the gains become those at
/// that μ. Returns the slopes of the frames at the base.
FrameVector riccati_answer(std::span<const RiccatiStage> stages, int first, double mu, bool anew,
                           double least_pivot, std::span<RiccatiGain> gains, const FrameStages&,
                           std::span<const FedStage> fed);

}  // namespace physics
