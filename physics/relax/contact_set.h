#pragma once
/// The forces on a wire's joints: the wire's load and the contacts, which are asked for again only where a
/// joint touches or may have come to touch.

#include <vector>

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

/// Force and stiffness summed over all joints from one joint to the tip: s₍i,N₎ = λ·force and R₍i,N₎ =
/// λ²·stiffness of Eq. 12; the force includes the load.
struct PushSum {
    Vec3 force = Vec3::Zero();      // on wall and load [N]
    Mat3 stiffness = Mat3::Zero();  // [N/mm]
};

/// Joints from `joint` to the tip move by `by` [mm].
struct TailStep {
    int joint = 0;
    Vec3 by = Vec3::Zero();
};

/// The load that a wire's joints bear, as felt by its segments.
class CarriedLoad {
public:
    void weigh(const Chain&);
    bool none() const { return carried_.empty(); }
    /// Load on all joints from this one to the tip [N].
    Vec3 from(int joint) const { return none() ? Vec3(Vec3::Zero()) : Vec3(carried_[joint] * load_); }
    /// Energy of joints first…last and of the step after them; it is 0 with all of them at x_{first-1}
    /// [N·mm].
    double energy(std::span<const Vec3> joints, int first, int last) const;
    void state(StateStream& s) { s(load_, carried_); }
    /// Upper bound of that energy's size, for measuring rounding [N·mm].
    double scale(int first) const { return none() ? 0.0 : load_.norm() * carried_[first] * carried_[first]; }

private:
    Vec3 load_ = Vec3::Zero();     // [N/mm]
    std::vector<double> carried_;  // [i] = length whose load joints ≥ i bear [mm]; empty without load
};

/// What holding joints to the wall's field that they are in changes.
struct KeptFields {
    double energy = 0;  // of the evaluation, <= 0 [N·mm]
    double jump = 0;    // between the fields, for joints that went too far past a border to be held [N·mm]
};

/// A joint out of touch is not asked for again while it stays within its contact's trust; a joint in touch is
/// asked for every time. A change is evaluated first and then committed or dropped, so that a rejected update
/// costs no second query. A contact has the joint's fraction of the wall, Chain::wall_share, and its give.
class ContactSet {
public:
    explicit ContactSet(const LumenWall& wall) : wall_(wall) {}

    void reset(const Chain&);  // ask for every joint
    /// The same for a chain with more joints than one that has these contacts at those places: joint i lies
    /// near joint near[i] of it, and is not asked for where that one's trust covers it.
    void reset_near(const Chain&, std::span<const int> near, std::span<const WallContact>,
                    std::span<const Vec3> at);
    /// The next update asks for every joint.
    void forget();
    /// Ask for the joints that have moved, or changed station, since they were last asked for, unless they
    /// are trusted to touch nothing. Takes up the wire's load as well.
    void update(const Chain&);

    /// Takes up thickness, lengths and gives of a chain that has been fed but not moved: the next questions
    /// are asked with them.
    void refit(const Chain&);

    /// Corrects joints whose station lies in another vessel than that of a neighbour, if they touch there:
    /// where the neighbour's station leads to one that holds the joint deeper in the lumen, the joint takes
    /// that one. So a joint that has come out of a side branch is held by the vessel it came into: where two
    /// lumens overlap, their union counts. A joint that was trusted to touch nothing is asked anew, because
    /// its station may be left behind. Returns the first joint whose contact changed, or -1.
    int rejoin_vessels(const Chain&);

    /// Energy in wall and load [N·mm] of joints ≥ first, with all joints from x_{first-1} on at these
    /// positions. The load's energy is 0 with all of them at x_{first-1}. The answers wait for commit().
    double evaluate(std::span<const Vec3> joints, int first) {
        return evaluate(joints, first, static_cast<int>(joints.size()) - 1);
    }
    /// The same where no joint past `last` has moved: energy of joints first…last.
    double evaluate(std::span<const Vec3> joints, int first, int last);
    /// Joints that the last evaluate led into another of the wall's fields, where they lie deeper in the
    /// wall, stay with their own from now on: the jump between fields would let them rest nowhere.
    KeptFields hold();
    /// Lets every joint change over again.
    void release() { held_.clear(); }
    void commit();
    /// The joints that the last evaluate asked for, ascending, and the answers. All others touch nothing.
    std::span<const int> asked() const { return index_; }
    std::span<const WallContact> answers() const { return answer_; }
    /// The same energy from the committed contacts, which were asked for at these positions.
    double energy(std::span<const Vec3> joints, int first) const {
        return energy(joints, first, static_cast<int>(joints.size()) - 1);
    }
    double energy(std::span<const Vec3> joints, int first, int last) const;
    double load_scale(int first) const { return load_.scale(first); }

    /// For sweeps of updates, with the interface of StoredPlanes. move() moves the wire's joints, from the
    /// steps' first to `last`, and returns their energy; commit() or undo() follows.
    void start_sweep(Chain&, int first);
    void settle(Chain&, int) {}
    void settle_all(Chain&) {}
    const Chain& settled(const Chain& wire) const { return wire; }
    double energy(const Chain& wire, int first, int last) const { return energy(wire.joints, first, last); }
    double move(Chain&, std::span<const TailStep>, int last);
    void undo(Chain&) const;

    int last_touching() const { return touching_.empty() ? -1 : touching_.back(); }
    int touching() const { return static_cast<int>(touching_.size()); }
    PushSum sum_from(int joint) const;  // of the committed contacts and the load
    std::span<const WallContact> contacts() const { return contacts_; }
    long long queries() const { return queries_; }
    void state(StateStream& s) {
        s(contacts_, fractions_, thickness_, vessels_, asked_at_, touching_, load_, queries_, held_);
        if (s.restores()) sums_.clear();
    }

private:
    WallContact question(int joint, int station) const;
    WallContact asked_from(int station, int joint, const Vec3& x, bool held = false);
    bool rejoin_vessel(const Chain&, int joint, int neighbour);  // whether its contact changed
    void list_touching(int first);
    void sum_pushes() const;
    bool known(int joint, const Vec3& x) const {
        const WallContact& c = contacts_[joint];
        return !c.touches() && c.thickness == thickness_[joint] &&
               (x - asked_at_[joint]).squaredNorm() < c.trust * c.trust;
    }
    void begin();  // a round of questions: add them, then ask them at once
    void add(int joint, const Vec3& x, int station, const Vec3& given);
    void ask();

    const LumenWall& wall_;
    std::vector<WallContact> contacts_;  // per joint; [0], the introducer's, is never asked
    // Per joint, for the next question: its fraction of the wall's stiffness, thickness [mm], and vessel.
    std::vector<double> fractions_, thickness_;
    std::vector<WallContact> vessels_;
    std::vector<int> held_;              // joints that stay with the field they are in, ascending
    std::vector<Vec3> asked_at_;         // where each was asked
    std::vector<int> touching_;          // joints in touch, ascending
    mutable std::vector<PushSum> sums_;  // [k] = sum from touching_[k] to the tip; empty until asked for
    CarriedLoad load_;
    long long queries_ = 0;
    // scratch of move and evaluate
    int first_moved_ = 0;
    std::vector<Vec3> unmoved_;
    std::vector<int> index_;
    std::vector<Vec3> at_;
    std::vector<WallContact> answer_;
};

}  // namespace physics
