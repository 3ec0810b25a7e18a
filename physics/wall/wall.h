#pragma once
/// The answer of a lumen wall to a joint that may touch it.

#include <span>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace physics {

using namespace geometry;

struct WallContact {
    double penetration = 0;      // of the wire's surface through the wall, > 0 outside the lumen [mm]
    Vec3 normal = Vec3::Zero();  // ∇ of penetration: points out of the lumen, of unit length except where
                                 // DistanceField's spline is only nearly a distance; zero out of reach
    Mat3 curvature = Mat3::Zero();  // ∇² of penetration; zero for a wall of planes [1/mm]
    double stiffness = 0;           // k of this joint; a wall returns that of a joint of the spec's λ [N/mm]
    Vec3 stiffening = Vec3::Zero();  // ∇k: zero unless the stiffness changes along the vessel [N/mm²]
    double trust = 0;                // the joint touches nothing while it stays within this of here [mm]
    double room = 0;   // radius of the lumen here: the scale of motion that stays in sight of the wall [mm]
    int station = -1;  // where along the vessel the joint is; pass it back with the next query
    double thickness = 0;  // of the joint beyond the radius that the wall knows; asked with the query [mm]
    bool held = false;     // asked with the query: near the border of two vessels, stay with the station's;
                           // false in the answer where the joint is too far past it

    bool touches() const { return penetration > 0; }
    double force() const { return touches() ? stiffness * penetration : 0.0; }  // [N]
    double energy() const { return 0.5 * force() * penetration; }  // Eq. 9 [N·mm], if it touches
    /// ∇ of the energy [N]: Eq. 11, and the term of a stiffness that changes along the vessel.
    Vec3 push() const { return force() * normal + stiffening_push(); }
    Vec3 stiffening_push() const {
        return touches() ? Vec3(0.5 * penetration * penetration * stiffening) : Vec3(Vec3::Zero());
    }
    void state(StateStream& s) {
        s(penetration, normal, curvature, stiffness, stiffening, trust, room, station, thickness);
    }
    void share_stiffness(double share) { stiffness *= share, stiffening *= share; }
};

/// Throws std::logic_error with the first joint whose position is not finite. Every wall calls it before it
/// looks for anything: a position that is not finite is a fault of the caller, and no wall can answer it.
void require_finite(std::span<const Vec3> joints);

/// A lumen wall. Its stations are hints that keep a joint in its branch between queries.
class LumenWall {
public:
    virtual ~LumenWall() = default;
    /// contacts[i] becomes the contact of joints[i]; on entry contacts[i].station is the old station or -1,
    /// contacts[i].thickness that of the joint, and `held` as it is wanted. Throws std::logic_error for a
    /// position that is not finite.
    virtual void contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const = 0;
    /// Whether two stations lie in one vessel, so that a joint held by one need not be checked against the
    /// other.
    virtual bool same_vessel(int, int) const { return true; }
    /// Whether penetration is twice continuously differentiable near the wall. Planes of a mesh are not: on
    /// them a Newton method comes only as near to rest as the planes jump.
    virtual bool smooth() const { return true; }
};

}  // namespace physics
