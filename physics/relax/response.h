#pragma once
/// What a chain at rest does, to first order, when something that it depends on changes while its hubs are
/// held.

#include <optional>
#include <span>
#include <vector>

#include "physics/geometry/mesh_query.h"
#include "physics/relax/contact_set.h"
#include "physics/relax/newton_model.h"
#include "physics/wall/foundation.h"

namespace physics {

/// To first order.
struct Moved {
    std::vector<Vec3> joints;    // [j] = how far joint j moves [mm]
    std::vector<double> forces;  // [j] = by how much the wall's force on joint j grows [N]

    const Vec3& tip() const { return joints.back(); }
    /// Of the largest of these contacts' forces [N].
    double largest_force(std::span<const WallContact>) const;
};

/// What friction does while something changes: its grips hold on, as at a rest that is left alone; or they
/// push as they do and hold nothing, as while a chain slides, of which the change is part of the way.
enum class Grips { Hold, Slide };

/// The linear response of a chain at a strict minimum: minus the inverse Hessian times the change of the
/// gradient, by one pass of the recursion and a short one for each answer (docs/solver.md, section 14). The
/// contacts that touch go on to touch, and no other begins to. Forces of friction and the vessels' gives are
/// held as they are, as they are while a rest is sought: what the coefficient of friction does depends on the
/// way that the chain has come, and has no derivative here. The wall must outlive it.
class Response {
public:
    Response(const LumenWall&, const Chain& rest, Grips = Grips::Hold);

    /// Whether the chain is a strict minimum; else there is no answer.
    bool exists() const { return exists_; }
    const Chain& rest() const { return rest_; }
    std::span<const WallContact> contacts() const { return contacts_.contacts(); }

    /// By how much the torque against which a rigid shaft's hub is held grows as that turns, all else
    /// answering; 0 where the shaft's frame does not matter [N·mm/rad].
    double torque_curve(int device) const;

    /// Where the chain, with its grips as they are here, becomes this one: the same joints, with other
    /// materials or thickness, assigned, or with hubs turned.
    std::optional<Moved> to(const Chain& changed) const;

    /// EI of a device by this part of it.
    std::optional<Moved> to_rigidity(int device, double part) const;
    /// The wall's stiffness by this part of it.
    std::optional<Moved> to_wall_stiffness(double part) const;
    /// The vessels' radius by this, or the devices' by as much less [mm].
    std::optional<Moved> to_radius(double by) const;
    /// A device's hub by this angle [rad].
    std::optional<Moved> to_turn(int device, double angle) const;
    /// [j] = how far the wall at joint j, with its grip on the joint, is moved; where it does not touch that
    /// counts nothing [mm].
    std::optional<Moved> to_moved_wall(std::span<const Vec3> by) const;

    /// Where this mesh is the wall of what touches; past an open end there is none. How far it is from the
    /// chain's own wall counts at each joint, and how much it is turned against that.
    struct OtherWall {
        double most_off = 0;  // at a joint that touches [mm]
        std::optional<Moved> moved;
    };
    OtherWall to_mesh(const geometry::MeshQuery&) const;
    /// Vessels that stay give way as the foundation has them, to forces that are then less: of the
    /// displacements in proportion to those by the forces of now, the one that agrees with its own forces in
    /// the mean.
    std::optional<Moved> to_vessels(const Foundation&) const;

private:
    std::vector<Vec3> displaced(const Foundation&, std::span<const double> forces) const;
    template <class Change>
    std::optional<Moved> to_small(double amount, const Change&) const;

    const LumenWall& wall_;
    Chain rest_;
    ContactSet contacts_;
    NewtonModel model_;
    FrameMatrix curve_ = {};  // of the energy by the frames' turns at the base [N·mm]
    bool exists_ = false;
};

}  // namespace physics
