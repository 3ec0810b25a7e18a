#pragma once
/// Second-order terms of the energy of a whole chain, as the stages of the Riccati recursion.

#include <vector>

#include "physics/relax/riccati.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

/// A contact in the model: penetration = gap + normal·(x − x_accepted).
struct ContactPlane {
    double gap = 0, stiffness = 0;
    Vec3 normal = Vec3::Zero();
    double force = 0;  // in its second-order terms [N]

    void state(StateStream& s) { s(gap, stiffness, normal, force); }
};

/// The devices whose material frames act on a chain: those bent at rest, and those that twist segment by
/// segment.
struct Frames {
    int count = 0;
    std::array<int, most_devices> device = {};  // of each frame
    std::array<int, most_devices> of = {};      // frame of each device, −1 = none
    bool each = false;                          // one twists segment by segment

    explicit Frames(const Chain&);
    Frames() = default;
    bool operator==(const Frames&) const = default;
    void state(StateStream& s) { s(count, device, of, each); }
};

/// Sums over everything distal of a segment.
struct DistalSums {
    double length = 0;          // whose load is felt [mm]
    Vec3 force = Vec3::Zero();  // of the wall on the chain, reversed [N]
    FrameVector torque = {};    // on each frame [N·mm]
    Vec2 slope = Vec2::Zero();  // of the joint between that segment and the next [N·mm]

    double whole_torque() const { return torque[0] + torque[1] + torque[2] + torque[3]; }
    void state(StateStream& s) { s(length, force, torque, slope); }
};

struct NewtonTerms {
    int first = 1;  // segment that the window starts with; what lies proximal stands still
    Frames frames;
    std::vector<RiccatiStage> stages;      // segments 1…N
    std::vector<Vec2> gradient;            // dU/dα per stage [N·mm]
    std::vector<FrameStage> frame_stages;  // frames.count a segment
    std::vector<double> mixed;             // as FrameStages has it; empty = none
    std::vector<double> frame_gradient;    // dU/dβ per frame stage, where each segment twists [N·mm]
    double relative_gradient = 0;  // in the window: largest |gradient| over C of the proximal joint [-]
    double proximal_gradient = 0;  // the same proximal of the window
    Vec3 push = Vec3::Zero();  // Σ of the forces of wall and load on the chain, reversed: what the introducer
                               // holds [N]
    double torque = 0;  // on all frames at the base: against which the hubs are held [N·mm]
    bool exact = true;  // the window's stages use the contacts' own forces in their second-order terms
    std::vector<double> inverse_spring;  // 1/C of the joint proximal of each segment [1/N·mm]
    DistalSums base;                     // from the window's most proximal segment on

    void state(StateStream& s) {
        s(first, frames, stages, gradient, frame_stages, mixed, frame_gradient, relative_gradient,
          proximal_gradient, push, torque, exact, inverse_spring, base);
    }
    std::span<RiccatiStage> window() { return std::span(stages).subspan(first - 1); }
    /// The frames of the segments from `from` on, with their gains.
    FrameStages framed(int from, std::vector<FrameGain>& gains) const {
        const std::size_t skip = static_cast<std::size_t>(from - 1) * frames.count;
        return {frames.count, std::span(frame_stages).subspan(skip),
                mixed.empty() ? std::span<const double>() : std::span(mixed).subspan(skip * frames.count),
                std::span(gains).subspan(skip)};
    }
};

/// A grip's gradient and Hessian by its stretch, at the accepted joint.
struct GripTerms {
    Vec3 drag = Vec3::Zero();       // [N]
    Mat3 stiffness = Mat3::Zero();  // [N/mm]

    GripTerms() = default;
    GripTerms(const Grip&, const Vec3& joint);
};
/// Adds them to the stage of their joint.
void add_grip(const GripTerms&, RiccatiStage&);
/// The same by the turn of the frame of the device that joint `j` holds, where it twists segment by segment.
/// `place` is the joint's from the introducer [mm].
void set_held_twist(const Chain&, int j, double place, const GripTerms&, NewtonTerms&);

/// Gradient and Hessian blocks of bending (Eq. 1, with rest directions), load and wall (Eq. 9, with the
/// wall's curvature) in the planes ⟂ u_j, u turned by u ← (u + Tα)/|u + Tα|, of the window from `first` on.
/// Exact except for terms of the twist of the order of torque times bend. The same loop does
/// riccati_backward() over the window: the work of making a stage runs while the recursion waits for its own
/// results. `directors` are as from physics::directors where something is bent. The second-order terms of a
/// joint in touch use its plane's force, as do those of a joint that has left the wall, which then counts as
/// touching; `planes` (per joint) become the contacts'. `gains` and `frame_gains` are the whole chain's. Push
/// and torque are those of the window alone. Allocates only to grow.
RiccatiReport assemble_and_solve(const Chain&, std::span<const WallContact>,
                                 const std::vector<Vec3>& directors, int first, double mu, double least_pivot,
                                 NewtonTerms&, std::span<ContactPlane> planes, std::span<RiccatiGain> gains,
                                 std::vector<FrameGain>& frame_gains);

/// Makes the gradient of the window's stages that of the chain as it is now, with the contacts' forces; all
/// else stays as it was made.
void update_slopes(const Chain&, std::span<const WallContact>, const std::vector<Vec3>& directors,
                   NewtonTerms&);

/// Gradient proximal of the window, whose stages stand as the last call left them, and what the introducer
/// holds of the whole chain.
void sum_proximal(const Chain&, std::span<const WallContact>, NewtonTerms&);

}  // namespace physics
