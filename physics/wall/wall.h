#pragma once
/// The answer of a lumen wall to a joint that may touch it.

#include <memory>
#include <optional>
#include <span>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace physics {

using namespace geometry;

class Foundation;

struct WallContact {
    double penetration = 0;      // of the wire's surface through the wall where it was before it made way,
                                 // > 0 outside the lumen [mm]
    Vec3 normal = Vec3::Zero();  // ∇ of penetration: points out of the lumen, of unit length except where
                                 // DistanceField's spline is only nearly a distance; zero out of reach
    Mat3 curvature = Mat3::Zero();   // ∇² of penetration; zero for a wall of planes [1/mm]
    double stiffness = 0;            // k of this joint: of wall and vessel in series [N/mm]
    Vec3 stiffening = Vec3::Zero();  // ∇k: zero unless the stiffness changes along the vessel [N/mm²]
    double trust = 0;                // the joint touches nothing while it stays within this of here [mm]
    double clearance = 0;  // radius of the lumen less that of the joint here: the scale of motion that stays
                           // in sight of the wall [mm]
    int station = -1;      // where along the vessel the joint is; pass it back with the next query
    // Asked with the query:
    double thickness = 0;       // of the joint beyond the radius that the wall knows [mm]
    double fraction = 1;        // of the wall's stiffness for a joint of the spec's λ [-]
    double give = 0;            // way of the vessel for each newton of the joint; 0 = it stays [mm/N]
    Vec3 along = Vec3::Zero();  // direction in which the vessel does not make way: its own; 0 = there is none
    Vec3 shift = Vec3::Zero();  // of the vessel by others' forces, held while a rest is sought [mm]
    Vec3 given = Vec3::Zero();  // how far the vessel has made way, with the shift; pass it back with the next
                                // query: where a joint may be in one of two places, it stays in its own [mm]
    bool held = false;  // asked with the query: near the border of two vessels, stay with the station's;
                        // false in the answer where the joint is too far past it

    bool touches() const { return penetration > 0; }
    double force() const { return touches() ? stiffness * penetration : 0.0; }  // [N]
    double energy() const { return 0.5 * force() * penetration; }  // Eq. 9 [N·mm], if it touches
    /// What of it is in the wall, and not in the tissue that makes way [N·mm].
    double wall_energy() const { return 0.5 * force() * pressed_in(); }
    /// ∇ of the energy [N]: Eq. 11, and the term of a stiffness that changes along the vessel.
    Vec3 push() const { return force() * normal + stiffening_push(); }
    Vec3 stiffening_push() const {
        return touches() ? Vec3(0.5 * penetration * penetration * stiffening) : Vec3(Vec3::Zero());
    }
    void state(StateStream& s) {
        s(penetration, normal, curvature, stiffness, stiffening, trust, clearance, station, thickness,
          fraction, give, along, shift, given);
    }
    /// How deep the joint is in the wall of the vessel as it has made way: of two springs in series that of
    /// the wall [mm].
    double pressed_in() const {
        return give > 0 && touches() ? force() * normal.norm() * (1 / stiffness - give) : penetration;
    }
    /// How far the vessel makes way for the joint a little beside, to first order [mm].
    Vec3 given_beside(const Vec3& by) const {
        const Vec3 change = give * (stiffness * normal.dot(by) * normal + force() * (curvature * by));
        return given + change - along.dot(change) * along;
    }
    /// Of the joint on its vessel, across it, where that makes way [N].
    Vec3 on_vessel() const { return give > 0 ? Vec3((given - shift) / give) : Vec3(Vec3::Zero()); }
    void soften(double by) { stiffness *= by, stiffening *= by; }
};

/// Throws std::logic_error with the first joint whose position is not finite. Every wall calls it before it
/// looks for anything: a position that is not finite is a fault of the caller, and no wall can answer it.
void require_finite(std::span<const Vec3> joints);

/// A lumen wall. Its stations are hints that keep a joint in its branch between queries.
///
/// A joint that presses with the force f moves its vessel by give · f, across the vessel: wall and vessel are
/// two springs in series. With pen(y) the depth in the vessel where it was, the joint's energy is
///     U(x) = min over y of |x − y|²/(2 give) + k pen(y)²/2,   x − y ⟂ along,
/// as smooth as pen is; its place y is never deeper in the wall than the force explains, however far the
/// vessel has made way. Where pen is a distance, U is that of a wall with the stiffness 1/(1/k + give). If
/// the vessel could make way along itself, a joint that has pushed a bend aside by more than its radius would
/// have two places.
class LumenWall {
public:
    virtual ~LumenWall() = default;
    /// contacts[i] becomes the contact of joints[i]; on entry contacts[i].station is the old station or -1,
    /// and what is asked with the query is as it is wanted. Throws std::logic_error for a position that is
    /// not finite.
    void contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const;
    /// The same of vessels that stay where they are: share and give do not count.
    virtual void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const = 0;
    /// What the vessels lie in; none where they do not move.
    const Foundation* foundation() const { return foundation_.get(); }
    void lie_in(std::shared_ptr<const Foundation> foundation) { foundation_ = std::move(foundation); }
    /// Whether two stations lie in one vessel, so that a joint held by one need not be checked against the
    /// other.
    virtual bool same_vessel(int, int) const { return true; }
    /// Whether penetration is twice continuously differentiable near the wall. Planes of a mesh are not: on
    /// them a Newton method comes only as near to rest as the planes jump.
    virtual bool smooth() const { return true; }
    /// Gives a contact the stiffness of the vessel there and its gradient, where that changes along it.
    virtual void apply_stiffness(const Vec3&, WallContact&) const {}
    /// What holds a device of that radius [mm] there besides friction on a wall that it presses on: a clot,
    /// or a wall that would be narrower than it is. `friction`: its coefficient on the wall [N/mm].
    virtual double holds(const Vec3&, double /*radius*/, double /*friction*/) const { return 0; }

private:
    WallContact rigid_contact(const Vec3& at, int station, const WallContact& asked) const;
    WallContact yielding(const Vec3& x, const WallContact& asked) const;
    WallContact shifted(const Vec3& x, WallContact asked) const;
    bool made_way(const Vec3& x, WallContact& at, Vec3 y) const;
    std::optional<Vec3> find_place(const Vec3& x, WallContact& at, Vec3& y) const;

    std::shared_ptr<const Foundation> foundation_;
};

}  // namespace physics
