#pragma once
/// Devices that share one centreline, as a wire in a catheter: each has its own length, roll, stiffness and
/// rest shape, and the energies add up. The clearance between them is neglected (Webster et al. 2006).
///
/// The chain of joints is as long as the device that reaches farthest. What a joint feels of a device is
/// weighted by a tent between its neighbours, so that energy and push are continuous while it moves along.

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace physics {

using namespace geometry;

struct Guidewire;
struct WallContact;

/// A piece of a device's rest shape.
struct RestArc {
    double length = 0;  // [mm]
    double angle = 0;   // of its turn, 0 = straight [rad]
    double plane = 0;   // in which it turns, about the device's axis [rad]

    void state(StateStream& s) { s(length, angle, plane); }
};

/// What one of several coaxial devices is made of; s is the distance from its distal end.
struct DeviceSpec {
    double outer_diameter = 0.889, inner_diameter = 0;  // [mm]; 0 = solid
    double shaft_rigidity = 250, tip_rigidity = 6;      // EI [N·mm²]
    double tip_length = 30, transition_length = 150;    // EI as in GuidewireSpec [mm]
    double torsional_rigidity = 0;  // GJ of the shaft, elsewhere as EI; 0 = the tip follows at once [N·mm²]
    double friction = 0;            // μ on the wall [-]
    double buckling_force = 0;      // push at which the shaft outside bows; 0 = none [N]
    double length = 1800;           // [mm]
    std::vector<RestArc> shape;     // from the distal end; proximal of it straight

    void state(StateStream& s) {
        s(outer_diameter, inner_diameter, shaft_rigidity, tip_rigidity, tip_length, transition_length,
          torsional_rigidity, friction, buckling_force, length, shape);
    }
};

/// Everything that makes the spec unusable, a sentence each; empty when it is fine.
std::vector<std::string> problems(const DeviceSpec&);

/// EI and GJ at distance s [mm] from the distal end of a wire or device with a soft tip [N·mm²].
template <class Spec>
double rigidity_at(const Spec& d, double s) {
    if (s <= d.tip_length) return d.tip_rigidity;
    const double t = s - d.tip_length;
    if (t >= d.transition_length) return d.shaft_rigidity;
    return d.tip_rigidity * std::pow(d.shaft_rigidity / d.tip_rigidity, t / d.transition_length);
}
template <class Spec>
double torsional_rigidity_at(const Spec& d, double s) {
    return d.torsional_rigidity * rigidity_at(d, s) / d.shaft_rigidity;
}

/// Length of the part that is curved at rest, from the distal end [mm].
double shaped_length(const DeviceSpec&);

/// A device on a chain.
struct CoaxialDevice {
    DeviceSpec spec;
    double inserted = 0;  // from the introducer to its distal end, along the chain [mm]
    double roll = 0;      // turn of its shape about u_0 against the chain's base director [rad]
    double windup = 0;    // turn of its hub that has not reached the shape [rad]
    // They follow from the above and the chain.
    bool bends = false;  // without load, at a joint of the chain
    // Per joint.
    std::vector<double> share;     // of the joint's length that it covers [-]
    std::vector<double> rigidity;  // mean EI over the joint's length, 0 where it is not [N·mm²]
    std::vector<Vec2> bend;        // without load, toward the device's director and aside of it [rad]
    /// Energy of a joint along which the rest curvature varies, however it bends: ½∫EI (κ₀ − mean)². It moves
    /// no joint, but without it a device would be pushed by the joints that it passes [N·mm].
    std::vector<double> stored;

    void state(StateStream& s) { s(spec, inserted, roll, windup, bends, share, rigidity, bend, stored); }
};

/// Bend of a device at rest at a joint: by `angle` in the plane of u and `way`, ⟂ u.
struct RestBend {
    double angle = 0;  // [rad]
    Vec3 way = Vec3::Zero();
};
/// `director` is the chain's at the segment proximal of the joint, whose tangent is u.
RestBend rest_bend(const CoaxialDevice&, int joint, const Vec3& u, const Vec3& director);

/// A chain of the devices, innermost first, laid along the path with their lengths of wire inside; λ is the
/// chain's. The wall must know the radius of the innermost device. Throws std::invalid_argument on bad specs,
/// no device, or less than two segments inside.
Guidewire coaxial_chain(const std::vector<CoaxialDevice>&, double segment_length, const Polyline& path);

/// Makes the per-joint arrays of chain and devices again, after the chain or what is inserted has changed.
void assign_devices(Guidewire&);

/// Which devices of a chain move.
constexpr int every_device = -1;

/// Least length that stays inside of a chain's longest device [mm].
double least_chain(const Guidewire&);

/// Moves a device along the chain, or every one, by up to λ; the chain grows and shrinks at its distal end.
/// Anchors of grips go with the material that holds them. Less is moved where a device is out, or the whole
/// chain would be; returns the length moved [mm].
double feed_device(Guidewire&, int device, double mm);

/// Torque that twists the device's shaft, from the introducer to its shape, by 1 rad [N·mm]; 0 for one that
/// does not twist, or has no bend on the chain to hold it.
double windup_stiffness(const CoaxialDevice&);

/// Σ of the energies in the twist of the devices' shafts [N·mm].
double windup_energy(const Guidewire&);

/// Turns a device's hub, or every one's [rad]; its shape follows at once, or the shaft winds up.
void rotate_device(Guidewire&, int device, double angle);

/// Σ of the energies of a joint's devices, the stored ones included [N·mm].
double coaxial_energy(const Guidewire&, int joint, const Vec3& director);

/// What the hand feels at a device's hub.
struct HubLoad {
    double push = 0;    // > 0 where the hand must push [N]
    double torque = 0;  // dU/droll: against which the hub is held [N·mm]

    void state(StateStream& s) { s(push, torque); }
};
/// Of each device, with the contacts of all joints, which stay where they are: the energy's change as the
/// device's material moves on. The pushes add up to hand_force().
std::vector<HubLoad> hub_loads(const Guidewire&, std::span<const WallContact>);

}  // namespace physics
