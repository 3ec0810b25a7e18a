#pragma once
/// The wall near a wire, asked for once a sweep: it serves a sweep of updates as a ContactSet does, with far
/// fewer queries and no work on joints away from the wall.

#include "physics/relax/contact_set.h"

namespace physics {

/// A joint that may come to touch within a sweep has a plane that rises on both sides round the vessel as the
/// wall does: pen(x) = pen + n·d + ½(h·d)², where d = x − the place asked for, h = c/√ρ, c is the direction
/// round the vessel and ρ the wall's radius there. Without h a wire swings round its vessel from sweep to
/// sweep. At every update the plane decides whether its joint touches. Where the wire moves farther than the
/// planes are good for, they are asked for anew. Joints distal of an update move only when they are settled.
class StoredPlanes {
public:
    explicit StoredPlanes(const LumenWall& wall) : wall_(wall) {}

    void reset(const Chain&);             // ask for every joint
    void start_sweep(Chain&, int first);  // rebuild the joints; ask again where a joint ≥ first moved
    void settle(Chain&, int segment);     // the joints proximal of `segment`, which is updated next
    void settle_all(Chain&);
    const Chain& settled(const Chain&);  // the wire with all pending moves made, for observers
    /// Energy in the wall [N·mm] of joints ≥ first. The load's energy starts at 0 with every update.
    double energy(const Chain&, int first, int last) const;
    /// The same after these steps, with the load's energy; commit() or undo() follows.
    double move(Chain&, std::span<const TailStep>, int last);
    void commit();
    void undo(Chain&) const {}

    int last_touching() const { return last_touching_; }  // of those distal of the update
    int touching() const;
    PushSum sum_from(int joint) const;
    double load_scale(int first) const { return load_.scale(first); }
    std::span<const WallContact> contacts() const { return contacts_; }  // as last asked
    long long queries() const { return queries_; }

private:
    struct Plane {
        int joint = 0;
        double penetration = 0, stiffness = 0;         // where it was asked [mm], [N/mm]
        Vec3 normal, hoop = Vec3::Zero(), stiffening;  // n; h [mm^-½]; ∇k [N/mm²]
        Vec3 moved;                                    // d [mm]
        double depth = 0, k = 0, up = 0;  // at d: penetration [mm], stiffness [N/mm], h·d [mm^½]
        void see();
        double energy() const { return depth > 0 ? 0.5 * k * depth * depth : 0.0; }
    };
    void ask(const Chain&, int first);
    double reach() const;
    void list(const Chain&, int first);
    Plane plane_of(const Chain&, int joint) const;
    void sum_up(int first_plane);
    double travel() const { return travelled_ + tail_.norm() + waiting_length_; }

    const LumenWall& wall_;
    std::vector<WallContact> contacts_;  // per joint, as last asked
    std::vector<Vec3> asked_at_;
    std::vector<Plane> planes_;     // of the joints near the wall, ascending
    std::vector<int> first_plane_;  // [i] = first plane of a joint ≥ i
    std::vector<PushSum> sums_;     // [k] = sum from planes_[k] to the tip
    int last_touching_ = -1;
    CarriedLoad load_;
    double reach_ = 0;     // joints without a plane don't touch while none moves farther [mm]
    int listed_from_ = 1;  // joints proximal of it may have moved farther
    // Moves that joints ≥ front_ have still to make: shift_, and from joint j on waiting_[j] as well [mm].
    int front_ = 1;
    Vec3 shift_ = Vec3::Zero();
    std::vector<Vec3> waiting_;
    double waiting_length_ = 0;            // Σ|waiting_|
    Vec3 tail_ = Vec3::Zero();             // by which joint front_ has moved since the planes were listed
    double travelled_ = 0, farthest_ = 0;  // upper bounds: in earlier passes; in this one
    // scratch of move and ask
    std::vector<TailStep> steps_;
    std::vector<Plane> trial_;
    std::vector<int> index_;
    std::vector<Vec3> at_;
    std::vector<WallContact> answer_;
    Chain settled_;
    long long queries_ = 0;
};

}  // namespace physics
