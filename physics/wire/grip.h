#pragma once
/// Dry friction between the wall and the wire's material: Coulomb's law with a little elastic give, as a
/// potential that is convex in the joints' positions while the normal forces are held.
///
/// Material moves through space: after wire is fed in, a joint holds material that was proximal of it. A
/// grip's anchor is the place where the material at the joint last held on to the wall, so it travels with
/// the material; force and normal are the wall's at that place and stay with the joint.

#include <span>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "physics/wall/wall.h"

namespace physics {

using namespace geometry;

/// Tangential stretch at which a grip lets go and slips [mm]: contact of a wire with a soft wall gives by
/// about this.
constexpr double slip_length = 0.05;

/// A surface that has slipped holds as one that slips, by the kinetic coefficient, until it has lain still
/// for this time, and then by the static one [s]. Simulated time, and not a number of frames or motions, so
/// that neither the rate of frames nor how a motion is cut decides; contacts grow stronger within tenths of a
/// second.
constexpr double rest_time = 0.1;

/// Since a surface slipped: 0 at the next let_rest(), which counts from there on.
constexpr double just_slipped = -1;

struct Grip {
    Vec3 anchor = Vec3::Zero();  // [mm]
    Vec3 normal = Vec3::Zero();  // of the wall, unit
    double force = 0;            // μN, the largest force that it resists; 0 without touch [N]
    // Of a wire that twists segment by segment: its surface also slips as it rolls.
    double roll = 0;             // of the material about its tangent since it last held on [rad]
    Vec3 around = Vec3::Zero();  // slip by a unit of it: the wire's radius times u × n [mm]
    /// Since it slipped or came to touch, up to rest_time: whether μ in `force` is the static one. Kept for
    /// devices of two coefficients only [s].
    double rested = rest_time;
    // Of the vessel at the joint, which stay with the joint: WallContact::give [mm/N], and ::given at the
    // last rest, from which the next one is sought [mm].
    double give = 0;
    Vec3 given = Vec3::Zero();
    Vec3 along = Vec3::Zero();  // WallContact::along
    Vec3 shift = Vec3::Zero();  // WallContact::shift [mm]

    bool holds() const { return force > 0; }
    /// Displacement e of the surface from where it held on, in the tangent plane, with `turn` more roll [mm].
    Vec3 stretch(const Vec3& joint, double turn = 0) const {
        const Vec3 from = joint - anchor;
        Vec3 e = from - normal.dot(from) * normal;
        if (roll + turn != 0) e += (roll + turn) * around;
        return e;
    }
    /// The potential: f|e|²/2ε while it sticks, f(|e| − ε/2) where it slips [N·mm].
    double energy(const Vec3& joint, double turn = 0) const;
    Vec3 push(const Vec3& joint) const;       // its gradient [N]
    Mat3 stiffness(const Vec3& joint) const;  // its Hessian, positive semidefinite [N/mm]
    /// Anchor and roll follow a joint that has slipped until the stretch is ε; they also follow a joint
    /// without touch. Changes no force. Returns the energy that the slip has cost [N·mm].
    double follow(const Vec3& joint);
    /// Resists up to `most` [N], no less than before, from now on. Anchor and roll come nearer, so that the
    /// push stays. Returns the energy that this frees [N·mm].
    double strengthen(const Vec3& joint, double most);
    bool rests() const { return rested >= rest_time; }

    /// Whether both hold alike; time alone moves nothing.
    bool operator==(const Grip& other) const {
        return anchor == other.anchor && normal == other.normal && force == other.force &&
               roll == other.roll && around == other.around && give == other.give && given == other.given &&
               along == other.along && shift == other.shift;
    }
    void state(StateStream& s) { s(anchor, normal, force, roll, around, give, given, along, shift, rested); }
};

/// Energy of the grips of joints from `first` on [N·mm]; either list may be empty.
double grip_energy(std::span<const Grip>, std::span<const Vec3> joints, int first);

}  // namespace physics
