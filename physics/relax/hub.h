#pragma once
/// A wire under a hand: fed, drawn back and turned at the hub, from rest to rest.

#include "physics/relax/global_relaxer.h"

namespace physics {

/// What came of a motion.
struct HubReport {
    enum class Outcome {
        AtRest,   // at rest, as far as `made` says
        Working,  // the budget ran out on the way to rest: resume() goes on
        Refused   // no part of it leads to a rest that a wire can be in: the wire is as it was
    };
    Outcome outcome = Outcome::AtRest;
    HubMotion made;     // since the last rest
    RelaxReport relax;  // of all that was tried
};

/// Moves a wire by parts that each end at rest. A part that does not is taken back and made again by halves:
/// one whose wire does not settle, is bent by more than a right angle at a joint, is farther outside than the
/// lumen is wide, or has more energy than the hand has done work.
class Hub {
public:
    /// The global relaxer's configuration; the wall must outlive the hub. Throws std::invalid_argument for
    /// another kind of relaxer.
    Hub(const RelaxerConfig&, const LumenWall&);

    /// Brings a wire to rest where it is; what it was before does not matter.
    HubReport settle(Guidewire&, int updates);
    /// Makes a motion, or a part of it, of a wire at rest: one segment's length and largest_turn at most.
    HubReport move(Guidewire&, const HubMotion&, int updates);
    /// Goes on with what ran out of its budget; the wire must be as it was left.
    HubReport resume(Guidewire&, int updates);
    bool working() const { return working_; }
    /// The wire where the motion that is being worked at began, at rest.
    const Guidewire& last_rest() const { return rest_; }

    /// Of the joints of a wire at rest.
    std::span<const WallContact> contacts() const { return relaxer_.contacts(); }

    void state(StateStream& s) {
        s(relaxer_, working_, settling_, rest_, rest_report_, rest_energy_, asked_, made_, halvings_);
    }

    static constexpr double largest_turn = 10 * degree;  // of one part [rad]

private:
    void start_part(Guidewire&, int updates, HubReport&);
    HubReport finish(Guidewire&, int updates, HubReport);
    bool can_be(const Guidewire&, const RelaxReport&, const HubMotion& made) const;
    double energy_of(const Guidewire&) const;

    GlobalRelaxer relaxer_;
    const LumenWall& wall_;
    bool working_ = false, settling_ = false;
    Guidewire rest_;  // where the motion began
    RelaxReport rest_report_;
    double rest_energy_ = 0;  // [N·mm]
    HubMotion asked_, made_;
    int halvings_ = 0;
};

}  // namespace physics
