#pragma once
/// A guidewire, catheter or sheath: what it is made of, and its state on a chain.

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace physics {

using namespace geometry;

/// Most devices on one chain: wire, micro-catheter, guide catheter, sheath.
constexpr int most_devices = 4;

/// A piece of a device's rest shape.
struct RestArc {
    double length = 0;  // [mm]
    double angle = 0;   // of its turn, 0 = straight [rad]
    double plane = 0;   // in which it turns, about the device's axis [rad]

    void state(StateStream& s) { s(length, angle, plane); }
};

/// A piece of a device with its own stiffness, which changes geometrically from its distal to its proximal
/// end.
struct StiffnessSection {
    double length = 0;                                    // [mm]; the most proximal one runs to the hub
    double rigidity_distal = 0, rigidity_proximal = 0;    // EI [N·mm²]
    double torsional_distal = 0, torsional_proximal = 0;  // GJ, 0 = does not twist [N·mm²]

    void state(StateStream& s) {
        s(length, rigidity_distal, rigidity_proximal, torsional_distal, torsional_proximal);
    }
};

/// What a device is made of.
struct DeviceSpec {
    double outer_diameter = 0.889, inner_diameter = 0;  // [mm]; 0 = solid
    std::vector<StiffnessSection> sections;             // from the distal end
    double friction = 0;                                // μ on the wall, of what slides [-]
    double buckling_force =
        0;                 // push at which the shaft outside bows and passes on no more; 0 = not stated [N]
    double length = 1800;  // [mm]
    std::vector<RestArc> shape;  // from the distal end; proximal of it straight
    // Static coefficients and forces hold what has lain still for rest_time; none, 0, is the kinetic one.
    double static_friction = 0;                            // μ on the wall [-]
    double inner_friction = 0, static_inner_friction = 0;  // μ of its lumen's surface on what lies in it [-]
    /// Force that the haemostatic valve and the sheath at its hub resist its slide with [N].
    double valve_friction = 0, static_valve_friction = 0;

    /// μ on the wall of what has lain still.
    double holding_friction() const { return std::max(friction, static_friction); }
    double holding_inner_friction() const { return std::max(inner_friction, static_inner_friction); }
    double holding_valve_friction() const { return std::max(valve_friction, static_valve_friction); }
    /// Whether static and kinetic values differ.
    bool sticks() const {
        return static_friction > friction || static_inner_friction > inner_friction ||
               static_valve_friction > valve_friction;
    }
    /// EI next to the hub [N·mm²].
    double shaft_rigidity() const { return sections.empty() ? 0.0 : sections.back().rigidity_proximal; }
    /// Whether its shaft can be twisted.
    bool twists() const { return !sections.empty() && sections.back().torsional_proximal > 0; }

    void state(StateStream& s) {
        s(outer_diameter, inner_diameter, sections, friction, buckling_force, length, shape);
        s(static_friction, inner_friction, static_inner_friction, valve_friction, static_valve_friction);
    }
};

/// The sections of a device with a soft tip and a shaft, EI rising geometrically between them; GJ is
/// everywhere the same multiple of EI.
std::vector<StiffnessSection> soft_tip(double tip_rigidity, double tip_length, double transition_length,
                                       double shaft_rigidity, double torsional_rigidity = 0);

/// Makes the device torsionally rigid.
void stiffen(DeviceSpec&);

/// The largest values that problems() accepts.
struct DeviceLimits {
    static constexpr double segment_length = 50;    // λ of a chain [mm]
    static constexpr double diameter = 10;          // [mm]
    static constexpr double rigidity = 1e5;         // [N·mm²]
    static constexpr double section_length = 4000;  // of all but the most proximal [mm]
    static constexpr double arc_length = 1000;      // [mm]
    static constexpr double arc_angle = 720;        // either way [deg]
    static constexpr double friction = 1;
    static constexpr double buckling_force = 100;  // [N]
    static constexpr double valve_friction = 20;   // [N]
};

/// Everything that makes the spec unusable, a sentence each; empty when it is fine.
std::vector<std::string> problems(const DeviceSpec&);

/// EI and GJ at distance s [mm] from the distal end [N·mm²].
double rigidity_at(const DeviceSpec&, double s);
double torsional_rigidity_at(const DeviceSpec&, double s);

/// ∫ ds/GJ between two distances from the distal end, of a device that twists [1/(N·mm)].
double torsional_give(const DeviceSpec&, double from, double to);

/// Length of the part that is curved at rest, from the distal end [mm].
double shaped_length(const DeviceSpec&);

/// Turn of a device at rest at a joint of its chain.
struct RestTurn {
    double angle = 0, cosine = 1, sine = 0;  // [rad]
    Vec2 direction = Vec2::Zero();           // unit, towards the device's own two directors

    bool operator==(const RestTurn&) const = default;
};

/// Length from the distal end beyond which a device is straight and uniform [mm].
double varying_length(const DeviceSpec&);

/// A part of a device that is wider and stiffer than the rest, and changes: a balloon. On the chain it is as
/// wide as when it is folded: what an inflated one may not do in its vessel is for the wall to say.
struct Bulge {
    double from_tip = 0;                  // of the device, to the first of `radii` [mm]
    std::vector<double> radii;            // `spacing` apart toward the hub [mm]
    double folded = 0;                    // radius of all of it when folded [mm]
    double rigidity = 0;                  // EI in addition [N·mm²]
    static constexpr double spacing = 1;  // [mm]

    bool operator==(const Bulge&) const = default;
    double length() const { return radii.empty() ? 0.0 : spacing * static_cast<double>(radii.size() - 1); }
    /// At distance s from the device's tip; 0 outside it [mm].
    double radius(double s) const;
    void state(StateStream& s) { s(from_tip, radii, folded, rigidity); }
};

/// A device on a chain. Its material frame at segment j is the chain's director turned about the tangent by
/// roll + wound[j].
struct Device {
    DeviceSpec spec;
    double inserted = 0;  // from the introducer to its distal end, along the chain [mm]
    double roll = 0;      // of its material frame at the introducer [rad]
    double windup =
        0;  // turn of the hub that has not reached the introducer: a shaft that twists as a whole [rad]
    /// [j] = turn of the material frame at segment j against that at the introducer, [0] = 0: a shaft that
    /// twists segment by segment. Empty for one that is rigid or twists as a whole [rad].
    std::vector<double> wound;
    /// Shaft between the hand and the introducer, which twists as the rest does [mm].
    double outside = 0;
    /// Whether a hand holds its hub. One that is not held is kept by its valve alone: see drag().
    bool held = true;
    /// Of a device with a balloon; none has more than one.
    std::vector<Bulge> bulge;

    // Follow from the above and the chain: assign().
    bool bends = false;            // at a joint of the chain, at rest
    std::vector<double> fraction;  // [joint] = of the joint's length that it covers [-]
    std::vector<double> rigidity;  // [joint] = its part of the chain's EI [N·mm²]
    std::vector<RestTurn> rest;    // [joint]
    /// Torque that twists the shaft as a whole, from the introducer to its shape, by 1 rad [N·mm]; 0 for one
    /// that is rigid, that twists segment by segment, or that has no bend on the chain to hold it.
    double windup_stiffness = 0;
    std::vector<double>
        torsion;  // [j] = κ: torque per twist of segment j, where it twists by segments [N·mm]

    /// Turn of the material frame at a segment against the chain's director [rad].
    double angle_at(int segment) const { return wound.empty() ? roll : roll + wound[segment]; }
    bool twists_by_segments() const { return !wound.empty(); }
    /// Whether its material frame acts on the chain.
    bool framed() const { return bends || !wound.empty(); }
    /// Turn of the hub that has not reached the distal end [rad].
    double wound_up() const { return wound.empty() ? windup : -wound.back(); }

    /// Of the device, at a distance from its tip, its balloon folded [mm].
    double radius(double s) const {
        const double own = 0.5 * spec.outer_diameter;
        const bool in_bulge = !bulge.empty() && s >= bulge.front().from_tip &&
                              s <= bulge.front().from_tip + bulge.front().length();
        return in_bulge ? std::max(own, bulge.front().folded) : own;
    }

    void state(StateStream& s) {
        s(spec, inserted, roll, windup, wound, outside, held);
        s.unless_empty(bulge);
    }
};

/// The same, with its balloon [mm].
double varying_length(const Device&);

/// Direction in space in which a device is bent at rest, and by how much.
struct RestBend {
    double cosine = 1, sine = 0;
    Vec3 direction = Vec3::Zero();  // unit, ⟂ u
    bool straight() const { return sine == 0 && cosine > 0; }
};
/// `director` is the chain's at the segment proximal of the joint, whose tangent is u.
RestBend rest_bend(const Device&, int joint, const Vec3& u, const Vec3& director);
/// Direction of the segment distal of the joint if the device alone were at rest.
Vec3 rest_direction(const Vec3& u, const RestBend&);

}  // namespace physics
