#pragma once
/// Newton step for all segments at once in O(N): the wire as an optimal-control problem, solved by a Riccati
/// recursion from the tip to the base and a rollout back.
///
/// Stage j turns segment j by α_j in the plane ⟂ u_j. State after stage j: displacement δx_j of joint j, α_j,
/// and the twist ψ_j of the material frame, with
///   δx_j = δx_{j-1} + λ_j T_j α_j,      ψ_j = ψ_{j-1} + twist_prev·α_{j-1} + twist·α_j.
/// The value function  V_j = ½δxPδx + δxP_xα + ½αP_aα + ψ(v·δx + w·α) + ½cψ² + p·δx + p_a·α + p_ψψ  is
/// carried from j = N to 1.

#include <span>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

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
    // wire distal of there, whose force is constant, is part of `slope`.
    Vec2 slope_prev = Vec2::Zero(), slope = Vec2::Zero();
    Mat2 prev_prev = Mat2::Zero(), own = Mat2::Zero(), cross = Mat2::Zero();  // cross: α_{j-1}ᵀ · cross · α_j
    // And with respect to the twist ψ_{j-1}; all zero where the wire's rest shape is straight.
    Vec2 twist_prev = Vec2::Zero(), twist = Vec2::Zero();  // [-]
    double slope_twist = 0, twist_twist = 0;
    Vec2 twist_cross_prev = Vec2::Zero(), twist_cross = Vec2::Zero();
    // The part of these four that a second device has: with respect to its turn ρ against the frame, which is
    // the same along the whole wire.
    double second_slope = 0, second_second = 0;
    Vec2 second_cross_prev = Vec2::Zero(), second_cross = Vec2::Zero();

    void state(StateStream& s) {
        s(basis, length, axial, touches, slope_prev, slope, prev_prev, own, cross, twist_prev, twist,
          slope_twist, twist_twist, twist_cross_prev, twist_cross);
        if (touches) s(force, stiffness);
        s.part(second_second != 0 || second_slope != 0, second_slope, second_second, second_cross_prev,
               second_cross);
    }
};

/// What of the stages' twist there is.
enum class Twist {
    None,  // every rest shape is straight
    One,   // all rest shapes turn with the material frame
    Two,   // those of a second device turn by ρ more
    Each   // all turn with the frame, and each segment twists by itself
};

/// Twist of a segment by itself: β_j is added to ψ_j, and costs κ(τβ + ½β²). The grip of the wall on joint j
/// feels ψ_j.
struct TwistStage {
    double stiffness = 0;  // κ = GJ/λ [N·mm]
    double slope = 0;      // κτ [N·mm]
    // Of the grip, with respect to ψ_j, and crosswise with δx_j [N·mm, N·mm, N].
    double grip_slope = 0, grip_grip = 0;
    Vec3 grip_cross = Vec3::Zero();

    void state(StateStream& s) { s(stiffness, slope, grip_slope, grip_grip, grip_cross); }
};

/// β_j = step + from_x δx_j + from_turn α_j + from_twist ψ', ψ' the twist of joint j without β_j.
struct TwistGain {
    double step = 0, from_twist = 0;
    Vec3 from_x = Vec3::Zero();
    Vec2 from_turn = Vec2::Zero();

    void state(StateStream& s) { s(step, from_twist, from_x, from_turn); }
};

constexpr double twist_arm = 1;  // by which the trust region weighs a turn of the material frame [mm]

/// Of the same segments as the stages and gains that they are given with; empty unless each twists.
struct SegmentTwists {
    std::span<const TwistStage> stages;
    std::span<TwistGain> gains;
};

/// [a b; b c]
struct SymmetricBlock {
    double a = 0, b = 0, c = 0;

    void state(StateStream& s) { s(a, b, c); }
};

/// α_j = step + from_x δx_{j-1} + from_prev α_{j-1} + from_twist ψ_{j-1} + from_second ρ.
struct RiccatiGain {
    Vec2 step = Vec2::Zero();
    Mat23 from_x = Mat23::Zero();
    Mat2 from_prev = Mat2::Zero();
    Vec2 from_twist = Vec2::Zero();   // set where there is twist
    Vec2 from_second = Vec2::Zero();  // set where there is a second device's
    SymmetricBlock inverse;           // minus the inverse Hessian block of α_j, all distal of it answering

    void state(StateStream& s) {
        s(step, from_x, from_prev, from_twist, inverse);
        if (!s.part(!from_second.isZero(0), from_second)) from_second.setZero();
    }
};

/// A segment that is fed more wire: joint j moves by `by` in addition to what the turns do [mm].
struct FedStage {
    int stage = -1;  // index into stages
    Vec3 by = Vec3::Zero();
};

struct RiccatiReport {
    int shifted = 0;  // pivots that were not positive definite and were shifted until they were
    // The most distal of them: its lower eigenvalue is the energy's own curvature along `way` while
    // everything distal answers by its gains. `way` leads down where the gradient vanishes.
    int stage = -1;           // index into stages
    Vec2 way = Vec2::Zero();  // unit; zero where it is the segment's twist that was shifted

    // Slope and curvature by the twist ψ at the base, everything distal of it answering.
    double slope_twist = 0, twist_twist = 0;
    // The same by ρ, and their cross term.
    double slope_second = 0, twist_second = 0, second_second = 0;

    void state(StateStream& s) { s(shifted, stage, way); }
};

/// Backward pass over stages 1…n (element 0 first). μ [N/mm²] adds μ λ_j to every joint's stiffness: a trust
/// region. What `twist` does not name is left out.
/// A pivot that is not positive is mirrored, and is at least `least_pivot` and at least what rounding leaves
/// of its block. Gains may still overflow where many such pivots follow one another.
/// Equal to a dense factorisation of the same quadratic model; no pivot shifted at μ = 0 means that the
/// model's Hessian is positive definite: a strict local minimum where the gradient vanishes.
RiccatiReport riccati_backward(std::span<const RiccatiStage> stages, double mu, double least_pivot,
                               Twist twist, std::span<RiccatiGain> gains, const SegmentTwists& = {});

/// Makes the gains' steps the answer to segments that change their length, to first order. `gains` are those
/// of the same stages at μ = 0. The stages from the tip to the most proximal fed one are processed again; for
/// the others down to `first` this takes a small part of a backward pass. With `anew` all stages are
/// processed again, and the gains become those at that μ.
/// Of two devices the second does not turn by itself, nor does a segment twist. Returns the slope of the
/// twist at the base.
double riccati_answer(std::span<const RiccatiStage> stages, int first, double mu, bool anew,
                      double least_pivot, Twist twist, std::span<RiccatiGain> gains,
                      std::span<const FedStage> fed);

}  // namespace physics
