#pragma once
/// The guidewire: a chain of rigid segments with bending stiffness and a pre-curved, torsionally rigid tip.
///
/// Joints x_0…x_N, x_0 fixed at the introducer; segment i joins x_{i-1} to x_i along the unit tangent u_i;
/// u_0 is the clamped entry direction. Joint i (0 ≤ i < N) bends between u_i and u_{i+1}.

#include <span>
#include <string>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "physics/wire/coaxial.h"
#include "physics/wire/grip.h"

namespace physics {

using namespace geometry;

/// Length of wire that the first and the last joint stand for.
enum class EndCells {
    Half,  // half of their one segment, as every joint stands for half of each of its two: second order in λ
    Paper  // the whole segment, which is first order in λ
};

/// What a wire is made of; s is the distance from its distal end.
struct GuidewireSpec {
    double segment_length = 2.0;  // λ [mm]
    EndCells end_cells = EndCells::Half;
    double diameter = 0.889;           // [mm]; 0.035 in
    double shaft_rigidity = 250.0;     // EI of the shaft [N·mm²]
    double tip_rigidity = 6.0;         // EI of the floppy tip [N·mm²]
    double tip_length = 30.0;          // s < tip_length is floppy [mm]
    double transition_length = 150.0;  // EI rises geometrically from tip to shaft over this length [mm]
    double curved_length = 12.0;       // s < curved_length is pre-curved [mm]
    double curved_angle = 0.785398163397448;  // total turn of the unloaded curved tip [rad]
    double friction = 0;                      // μ of the wire on the wall [-]
    double buckling_force = 0;  // push at which the shaft outside bows and passes on no more; 0 = none [N]
    double torsional_rigidity = 0;  // GJ of the shaft, elsewhere as EI; 0 = the tip follows at once [N·mm²]

    /// Segments of λ in the curved tip.
    int curved_segments() const;

    void state(StateStream& s) {
        s(segment_length, end_cells, diameter, shaft_rigidity, tip_rigidity, tip_length, transition_length,
          curved_length, curved_angle);
        if (!s.part(friction != 0, friction)) friction = 0;
        if (!s.part(torsional_rigidity != 0, torsional_rigidity)) torsional_rigidity = 0;
        if (!s.part(buckling_force != 0, buckling_force)) buckling_force = 0;
    }
};

/// The largest values that problems() accepts in a spec.
struct WireLimits {
    static constexpr double segment_length = 50;  // [mm]
    static constexpr double diameter = 10;        // [mm]
    static constexpr double rigidity = 1e5;       // [N·mm²]
    static constexpr double soft_length = 1000;   // of the tip, of the transition [mm]
    static constexpr double curved_length = 200;  // [mm]
    static constexpr double curved_angle = 270;   // either way [deg]
    static constexpr double friction = 1;
    static constexpr double buckling_force = 100;  // [N]
};

/// Whether a wire enters a lumen of this radius [mm].
inline bool enters(double wire_diameter, double lumen_radius) {
    return wire_diameter < 2 * lumen_radius;
}

/// Everything that makes the spec unusable, a sentence each; empty when it is fine.
std::vector<std::string> problems(const GuidewireSpec&);

/// State of a wire. Arrays over joints have N+1 entries; index i of `tangents` is segment i, [0] the clamped
/// entry direction. Change it through the functions below, which keep the parts consistent.
struct Guidewire {
    GuidewireSpec spec;
    std::vector<Vec3> joints;            // x_0…x_N [mm]
    std::vector<Vec3> tangents;          // u_0…u_N, unit
    std::vector<double> lengths;         // [i] = λ_i, i = 1…N; [0] unused [mm]
    std::vector<double> rigidity;        // [i] = EI at joint i, i = 0…N-1 (and [N] unused) [N·mm²]
    std::vector<double> rest_angle;      // [i] = turn of the unloaded wire at joint i [rad]
    std::vector<int> stations;           // wall hint per joint, -1 = unknown; see LumenWall
    Vec3 base_director = Vec3::UnitY();  // unit, ⟂ u_0: direction the tip curves to at roll 0
    double roll = 0;                     // turn of the tip's plane about u_0: the hub's less the windup [rad]
    Vec3 load = Vec3::Zero();  // force on the wire per length, e.g. its weight [N/mm]; joint i ≥ 1
                               // bears that of length_of(i)
    double carried = 0;        // motion not yet made, |carried| < λ [mm]
    double windup = 0;  // turn of the hub that has not reached the tip: the shaft is twisted by it [rad]
    /// [i] = turn of the material frame from segment i−1 to segment i on top of parallel transport, i = 1…N:
    /// a shaft that twists segment by segment. Empty for one that is rigid or winds up as a whole [rad].
    std::vector<double> twists;
    std::vector<double> torsion;  // [i] = GJ_i/λ_i, where there are twists [N·mm]
    std::vector<Grip> grips;      // of the wall on each joint; empty for a wire without friction
    double friction_loss =
        0;  // energy that they have cost so far: slip, and the stretch of material that let go [N·mm]
    /// Devices on the chain, innermost first; empty for a wire alone, which is what `spec` says. With devices
    /// `spec` is the chain's: without a shape, its diameter that of the innermost, `rigidity` their sum, and
    /// `roll` and `windup` are 0: each device has its own.
    std::vector<CoaxialDevice> devices;
    std::vector<double> thickness;  // of joints beyond the radius of the spec's diameter; empty = none [mm]
    std::vector<double> surface_friction;  // μ of the outermost device per joint; empty = the spec's
    int bent = 0;                          // distal segments from the first joint that devices bend at rest

    void state(StateStream& s) {
        s(spec, joints, tangents, lengths, rigidity, rest_angle, stations, base_director, roll, load,
          carried);
        if (!s.part(!grips.empty(), grips, friction_loss)) grips.clear(), friction_loss = 0;
        if (!s.part(windup != 0, windup)) windup = 0;
        if (!s.part(!twists.empty(), twists, torsion)) twists.clear(), torsion.clear();
        if (!s.part(!devices.empty(), devices, thickness, surface_friction, bent)) {
            devices.clear(), thickness.clear(), surface_friction.clear();
            bent = 0;
        }
    }
    int segments() const { return static_cast<int>(joints.size()) - 1; }
    const Vec3& tip() const { return joints.back(); }
    /// Length of wire that the joint stands for: half of each of its segments [mm].
    double length_of(int joint) const {
        if (joint > 0 && joint < segments()) return 0.5 * (lengths[joint] + lengths[joint + 1]);
        const double only = lengths[joint == 0 ? 1 : joint];
        return spec.end_cells == EndCells::Half ? 0.5 * only : only;
    }
    /// C_i = EI_i over the length that joint i stands for [N·mm].
    double spring_constant(int joint) const { return rigidity[joint] / length_of(joint); }
    /// Wall stiffness of the joint relative to a joint of the spec's λ: a wall is as stiff per length of wire
    /// however coarse the wire is. 1 for every joint between two segments of the spec's λ.
    double wall_share(int joint) const { return length_of(joint) / spec.segment_length; }
    double inserted_length() const;  // Σλ [mm]
    /// Torque that twists the shaft, from the introducer to the curved tip, by 1 rad [N·mm]; 0 for a shaft
    /// that does not twist as a whole: a rigid one, one without a tip to hold it, or one with twists.
    double windup_stiffness() const;
    /// Turn of the hub that has not reached the distal end [rad].
    double wound_up() const;
    /// Torque against which the hub is held [N·mm].
    double windup_torque() const { return windup == 0 ? 0.0 : windup_stiffness() * windup; }
    int curved_segments() const;  // segments of the pre-curved tip, each piece counted
    /// Distal segments whose energy depends on their material frames: from the first joint that is bent at
    /// rest, of the wire alone or of a device, or all of a wire with twists.
    int bent_segments() const {
        if (!twists.empty()) return segments();
        return devices.empty() ? curved_segments() : bent;
    }
    /// μ of what lies outermost at the joint, on a wall [-].
    double friction_at(int joint) const {
        return surface_friction.empty() ? spec.friction : surface_friction[joint];
    }
    double thickness_at(int joint) const { return thickness.empty() ? 0.0 : thickness[joint]; }
    /// Whether a joint lies between two pieces that make up one segment of the spec's λ in a whole wire.
    bool within_a_segment(int joint) const;
};

/// A wire of `segments` segments along `direction` (any length) from `entry`, without load.
/// Throws std::invalid_argument on a bad spec, direction or fewer segments than the curved tip plus one.
Guidewire straight_wire(const GuidewireSpec&, const Vec3& entry, const Vec3& direction, int segments);

/// A wire with its joints on `path`, each exactly λ from the last, starting at path.front().
Guidewire wire_along(const GuidewireSpec&, const Polyline& path, int segments);

/// The same with `length` [mm] of wire inside, λ apart except for one segment just before the curved tip, as
/// feed() leaves it. Throws std::invalid_argument for less than least_length(spec).
Guidewire wire_of_length(const GuidewireSpec&, const Polyline& path, double length);

/// Least length of wire inside: the curved tip and one segment [mm].
double least_length(const GuidewireSpec&);

/// A wire of uniform rigidity with straight rest shape through given tangents.
Guidewire uniform_wire(double rigidity, double segment_length, const Vec3& entry, const Vec3& clamped,
                       const std::vector<Vec3>& tangents, EndCells = EndCells::Half);

/// Gives every joint a grip with its anchor where the joint is: the wire is as at rest without friction. Does
/// nothing for a wire whose spec has no friction.
void start_grips(Guidewire&);

/// Lets the shaft of a wire alone twist segment by segment, from where its hub is now. Does nothing for a
/// wire whose spec has no torsional rigidity.
void start_twists(Guidewire&);

/// ½ Σ κτ² of the segments from `first` on, κ = GJ/λ [N·mm].
double twist_energy(const Guidewire&, std::span<const double> twists, int first);

/// Split a segment, `share` of its length proximal of the new joint. Its parts bend by the mean of the
/// curvatures at its ends, so that the curve stays smooth; joints distal of it come closer, as the bent piece
/// is shorter across. The new joint is straight without load, also in the curved tip, and its grip holds
/// nothing until it is known to touch; its anchor lies between those next to it.
void split_segment(Guidewire&, int segment, double share = 0.5);

/// Merge this segment and the next into a straight one, as long as both; in the curved tip only pieces of one
/// segment. Joints distal of it move away along it by as much as the bent pair was shorter across.
void merge_segments(Guidewire&, int segment);

/// Feed `mm` of wire in (negative: out). The segment just before the curved tip, λ/2 to 3λ/2 long, grows or
/// shrinks; outside that range it gives a whole segment to the shaft or takes one from it, so that the wire's
/// segments depend on its length alone. Pieces of segments there are made whole. Returns the length fed in:
/// withdrawal ends at least_length().
double feed(Guidewire&, double mm);

/// How feed() would change the lengths of a wire's segments by up to λ either way.
struct FeedPlan {
    int grows = 0;             // segment
    double mm = 0;             // length fed in: as asked for, or less on the way out [mm]
    double change = 0;         // of that segment's length [mm]
    double change_before = 0;  // of the length of the segment before, on the way out [mm]
    bool whole =
        true;  // both are segments, not pieces of one, and not longer than 3λ/2: apply_feed() may be called
};
FeedPlan plan_feed(const Guidewire&, double mm);
/// Changes the lengths and splits or merges segments that are too long or too short; anchors move on with the
/// material. The plan must be `whole` and made for this wire; only its tangents may differ.
void apply_feed(Guidewire&, const FeedPlan&);
/// Twists of the wire's segments once it is fed by the plan, before any split or merge: those of the material
/// which then lies there. What comes in is not twisted, and what goes out leaves its twist inside.
std::vector<double> fed_twists(const Guidewire&, const FeedPlan&);
/// Grips of the wire's joints once it is fed by the plan, before any split or merge: each anchor is that of
/// the material which then lies at the joint. Stretch mixes between joints; the energy that this takes is
/// added to `lost`.
std::vector<Grip> fed_grips(const Guidewire&, const FeedPlan&, double& lost);

/// Insert one segment just before the curved tip (the paper, Section 2.1).
void insert_segment(Guidewire&);

/// Take out one segment of the spec's λ there, split off a longer one or made whole from pieces if need be.
/// False when only the curved tip and one such segment are left.
bool remove_segment(Guidewire&);

/// Move the wire by `mm` (negative = withdraw) in whole segments; the rest is carried.
/// Returns the number of segments inserted, or minus the number taken out.
int move(Guidewire&, double mm);

/// Turn the hub by `angle` [rad]; the tip follows at once, or the shaft winds up.
void rotate(Guidewire&, double angle);

/// Rebuild x_first…x_N from x_{first-1} and the tangents.
void rebuild_joints(Guidewire&, int first = 1);

/// Directors d_0…d_N: unit, d_i ⟂ u_i, the base director turned by roll and parallel-transported along the
/// wire. The unloaded wire continues segment i along cos β u_i + sin β d_i, β the rest angle of joint i.
std::vector<Vec3> directors(const Guidewire&);

/// Recompute directors[i] for i ≥ first in place (first ≥ 1; directors[first-1] must be right).
void transport_directors(const Guidewire&, int first, std::vector<Vec3>& directors);

/// The base director turned by roll.
Vec3 rolled_director(const Guidewire&);

/// What is wrong with the state: non-finite numbers, tangents not unit (1e-12), joints not λ apart (1e-9).
std::vector<std::string> validate(const Guidewire&);

}  // namespace physics
