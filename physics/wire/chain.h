#pragma once
/// A chain of rigid segments that carries one or more devices, innermost first: a wire alone, or a wire in
/// catheters. The devices share the chain's centreline and their energies add up; the clearance between them
/// is neglected (Webster et al. 2006).
///
/// Joints x_0…x_N, x_0 fixed at the introducer; segment i joins x_{i-1} to x_i along the unit tangent u_i;
/// u_0 is the clamped entry direction. Joint i (0 ≤ i < N) bends between u_i and u_{i+1}. The chain is as
/// long as the device that reaches farthest, the leading one, and devices slide along it: joints stay at
/// whole multiples of λ from the introducer, but for those of the leading device's shape, which go with it.
/// Between them lies the segment that grows as the chain does.

#include <string>
#include <vector>

#include "physics/wire/device.h"
#include "physics/wire/grip.h"
#include "physics/wire/rub.h"

namespace physics {

/// Length of chain that the first and the last joint stand for.
enum class EndCells {
    Half,  // half of their one segment, as every joint stands for half of each of its two: second order in λ
    Paper  // the whole segment, which is first order in λ
};

/// Lengths of the chain's segments.
struct Grid {
    double segment_length = 2.0;  // λ [mm]
    EndCells end_cells = EndCells::Half;
    int tip_segments = 0;  // whole λ at the distal end that go with it at least: Chain::tip_segments

    void state(StateStream& s) {
        s(segment_length, end_cells);
        s.unless_zero(tip_segments);
    }
};

/// Part of a joint's energy that depends on how two devices are turned against each other: with Δ the turn of
/// `outer` less that of `inner`, along·cos Δ + aside·sin Δ [N·mm]. It is zero where their stiffnesses do not
/// change along the joint.
struct Coupling {
    int joint = 0, inner = 0, outer = 0;  // indices of devices
    double along = 0, aside = 0;
};

/// Arrays over joints have N+1 entries; index i of `tangents` is segment i, [0] the clamped entry direction.
/// Change a chain through the functions below and those of feed.h, which keep the parts consistent.
struct Chain {
    Grid grid;
    std::vector<Device> devices;         // innermost first
    std::vector<Vec3> joints;            // x_0…x_N [mm]
    std::vector<Vec3> tangents;          // u_0…u_N, unit
    std::vector<double> lengths;         // [i] = λ_i, i = 1…N; [0] unused [mm]
    std::vector<int> stations;           // wall hint per joint, -1 = unknown; see LumenWall
    Vec3 base_director = Vec3::UnitY();  // unit, ⟂ u_0: the plane that the devices' rolls start from
    Vec3 load = Vec3::Zero();  // force on the chain per length, e.g. its weight [N/mm]; joint i ≥ 1 bears
                               // that of length_of(i)
    int leading = 0;           // index of the device that the distal joints go with
    int tip_segments = 0;      // whole λ at the distal end that go with it, as far as they are inside
    double carried = 0;        // motion in whole segments not yet made, |carried| < λ [mm]
    std::vector<Grip> grips;   // of the wall on each joint; empty without friction in vessels that stay where
                               // they are
    bool vessels_stay = false;  // where they are, though the wall knows how they would make way
    double friction_loss =
        0;  // energy that they have cost so far: slip, and the stretch of material that let go [N·mm]
    std::vector<Rub> rubs;  // of devices in each other and in their valves; empty without such friction
    double rub_loss = 0;    // energy that they have cost so far [N·mm]

    // Follow from the above: assign().
    std::vector<double>
        rigidity;  // [i] = EI at joint i: of the devices side by side, and along it in series [N·mm²]
    std::vector<double> stored;           // [i] = energy of joint i that no bend releases [N·mm]
    std::vector<Coupling> couplings;      // by joint
    std::vector<double> thickness;        // of joints beyond the innermost device's radius [mm]
    std::vector<double> friction;         // [i] = μ of the outermost device [-]
    std::vector<double> static_friction;  // [i] = the same of what has lain still
    int bent = 0;                         // distal segments from the first joint that a device bends at rest

    void state(StateStream& s);

    int segments() const { return static_cast<int>(joints.size()) - 1; }
    const Vec3& tip() const { return joints.back(); }
    /// Length of chain that the joint stands for: half of each of its segments [mm].
    double length_of(int joint) const {
        if (joint > 0 && joint < segments()) return 0.5 * (lengths[joint] + lengths[joint + 1]);
        const double only = lengths[joint == 0 ? 1 : joint];
        return grid.end_cells == EndCells::Half ? 0.5 * only : only;
    }
    /// C_i = EI_i over the length that joint i stands for [N·mm].
    double spring_constant(int joint) const { return rigidity[joint] / length_of(joint); }
    /// Wall stiffness of the joint relative to a joint of λ: a wall is as stiff per length of chain however
    /// coarse the chain is. 1 for every joint between two segments of λ.
    double wall_fraction(int joint) const { return length_of(joint) / grid.segment_length; }
    double inserted_length() const;  // Σλ [mm]
    /// Segment that grows as the chain is fed, λ/2 to 3λ/2 long.
    int growing() const;
    /// Distal segments whose energy depends on the devices' material frames: from the first joint that one
    /// bends at rest, or all where one twists segment by segment.
    int bent_segments() const;
    /// Whether no device bends at the joint at rest, nor proximal of it.
    bool straight(int joint) const { return joint < segments() - bent; }
    /// Radius that walls are made for: the innermost device's [mm].
    double inner_radius() const { return 0.5 * devices.front().spec.outer_diameter; }
    /// Index of the outermost device at a distance from the introducer [mm].
    int outermost(double s) const;
    /// On the wall.
    bool has_friction() const;
    /// What a query of the wall asks for the joint of its vessel: how it makes way, and has at the last rest.
    void ask_vessel(int joint, WallContact& contact) const {
        if (grips.empty()) return;
        contact.give = grips[joint].give;
        contact.along = grips[joint].along;
        contact.shift = grips[joint].shift;
        contact.given = grips[joint].given;
    }
    /// Whether what has lain still is held by more than what slides.
    bool sticks() const;
    /// Whether a joint was put between two that lie λ apart.
    bool within_a_segment(int joint) const;
    /// [j] = the same of each joint.
    std::vector<bool> within_segments() const;
};

/// Whether a device enters a lumen of this radius [mm].
inline bool enters(double diameter, double lumen_radius) {
    return diameter < 2 * lumen_radius;
}

/// Everything that makes devices unusable on a grid, a sentence each; empty when they are fine.
std::vector<std::string> problems(const std::vector<Device>&, const Grid&);

/// Least length that stays inside: two segments [mm].
constexpr double least_length(const Grid& grid) {
    return 2 * grid.segment_length;
}

/// Makes the chain's grid that of its leading device, where another has come to lead: joints are laid anew
/// along the curve that they have now, at most λ²/8 times its curvature from it. Does nothing else.
void follow_leader(Chain&);

/// A chain of the devices with their lengths inside, laid along the path from path.front(), without load or
/// friction: joints λ apart but for the growing segment. Past its end the path goes on straight. Throws
/// std::invalid_argument on what problems() finds, a path that is not finite or starts with two equal points,
/// or less than least_length() inside.
Chain chain_along(std::vector<Device>, const Grid&, const Polyline& path);

/// A chain of one device with whole segments along `path`, or along `direction` (any length) from `entry`.
Chain wire_along(const DeviceSpec&, const Grid&, const Polyline& path, int segments);
Chain straight_wire(const DeviceSpec&, const Grid&, const Vec3& entry, const Vec3& direction, int segments);

/// A chain of one straight device of uniform rigidity through given tangents.
Chain uniform_wire(double rigidity, double segment_length, const Vec3& entry, const Vec3& clamped,
                   const std::vector<Vec3>& tangents, EndCells = EndCells::Half);

/// Makes again what follows from lengths and devices.
///
/// What a joint feels of a device is weighted by a tent w between its neighbours, so that energy and push are
/// continuous while the device moves along. Devices stand side by side: EI = Σ EI_k. Along the joint they are
/// in series: 1/C = ∫ w/EI ds, and the bend at rest is Σ_k t_k, t_k = ∫ w EI_k κ_k/EI ds, turned with device
/// k's frame. So joints are second order in λ also where a device ends. The joint is written as a sum over
/// devices of springs C f_k, f_k = ∫ w EI_k/EI ds / ∫ w ds, about t_k/f_k; what the sum lacks of the whole is
/// `stored` and `couplings`.
/// Only the joints from `first` on are made: proximal of them nothing has changed.
void assign_from(Chain&, int first);
inline void assign(Chain& chain) {
    assign_from(chain, 0);
}
/// First joint whose fraction of the devices changes where a device, or every one (-1), is fed.
int first_fed(const Chain&, int device);

/// Gives every joint a grip with its anchor where the joint is: the chain is as at rest without friction, in
/// vessels that have not made way. Does nothing for devices without friction, unless `vessels_move`.
void start_grips(Chain&, bool vessels_move = false);

/// Lets a device twist segment by segment, from where its hub is now. Does nothing for one that is
/// torsionally rigid.
void start_twists(Chain&, int device);

/// Σ of the energies in the twist of the devices' shafts [N·mm], by segments only from `first` on.
double twist_energy(const Chain&, int first = 1);

/// Split a segment, `fraction` of its length proximal of the new joint. Its parts bend by the mean of the
/// curvatures at its ends, so that the curve stays smooth; a bend at rest at an end counts only where the new
/// joint has one, too. Joints distal of it come closer, as the bent piece is shorter across. The new joint's
/// grip holds nothing until it is known to touch; its anchor lies between those next to it.
void split_segment(Chain&, int segment, double fraction = 0.5);

/// Merge this segment and the next into a straight one, as long as both. Joints distal of it move away along
/// it by as much as the bent pair was shorter across.
void merge_segments(Chain&, int segment);

/// Rebuild x_first…x_N from x_{first-1} and the tangents.
void rebuild_joints(Chain&, int first = 1);

/// Directors d_0…d_N: unit, d_i ⟂ u_i, the base director parallel-transported along the chain.
std::vector<Vec3> directors(const Chain&);

/// Recompute directors[i] for i ≥ first in place (first ≥ 1; directors[first-1] must be right).
void transport_directors(const Chain&, int first, std::vector<Vec3>& directors);

/// What is wrong with the state: non-finite numbers, arrays of different lengths, tangents that are not unit
/// (1e-12), joints that are not λ apart (1e-9), directors not ⟂, devices longer than the chain.
std::vector<std::string> validate(const Chain&);

}  // namespace physics
