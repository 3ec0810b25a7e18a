#pragma once
/// A wire under a hand: fed, drawn back and turned at the hub, from rest to rest.

#include <array>

#include "physics/relax/global_relaxer.h"

namespace physics {

/// The outcome of a motion.
struct HubReport {
    enum class Outcome {
        AtRest,   // at rest after the motion `made`
        Working,  // the budget ran out on the way to rest: resume() continues
        Refused   // no part of it leads to a rest that a wire can be in, or none was found with the work that
                  // a motion may take: the wire is unchanged
    };
    Outcome outcome = Outcome::AtRest;
    bool buckled = false;  // the whole motion asked for more push than the shaft outside can bear
    HubMotion made;        // since the last rest
    RelaxReport relax;     // of everything that was tried
};

/// Moves a wire by parts that each end at rest. A part is undone and tried again in halves when the wire does
/// not settle, is bent by more than a right angle at a joint, lies farther outside than the lumen is wide, or
/// gains more energy than the hand's work explains, and when the shaft outside cannot bear the push. All that
/// is tried for a motion takes at most most_work() updates, over however many calls; the same motion of a
/// wire that has not moved since is refused again at once.
///
/// No call exceeds its updates, if they are at least least_updates(): work that could is left for resume().
class Hub {
public:
    /// Takes the global relaxer's configuration; the wall must outlive the hub. Throws std::invalid_argument
    /// for another kind of relaxer.
    Hub(const RelaxerConfig&, const LumenWall&);

    /// The shaft outside of a device passes on this push from now on [N]; before, its buckling_force, or any
    /// push where it has none.
    void bear(int device, double push);

    /// Lets vessels that stay make way from now on, of a wall that knows how: nothing moves before the next
    /// call, which finds another rest where the wire presses.
    void let_vessels_make_way(Chain&) const;
    /// The same the other way: they go back to where they were.
    static void let_vessels_stay(Chain&);

    /// The wall is another from now on, and work that is under way is given up; settle() follows.
    void wall_has_changed();

    /// Brings a wire to rest where it is, whatever it was before.
    HubReport settle(Chain&, int updates);
    /// Makes a motion, or a part of it, with a wire at rest: at most one segment's length and largest_turn.
    /// Of several devices those move that the motion names.
    HubReport move(Chain&, const HubMotion&, int updates);
    /// Continues work that ran out of its budget; the wire must be as it was left.
    HubReport resume(Chain&, int updates);
    bool working() const { return working_; }
    /// Updates with which a call need not exceed them.
    static int least_updates(const Chain& wire) { return 16 * wire.segments(); }
    /// Push that the shaft of the wire, or of one of its devices, passes on [N]; infinity = any.
    double passes_on(const Chain&, int device = 0) const;

    /// Report of the last relaxation.
    const RelaxReport& last_report() const { return relaxer_.last_report(); }
    /// Contacts of the joints of a wire at rest.
    std::span<const WallContact> contacts() const { return relaxer_.contacts(); }
    /// What the hand feels at each device's hub of the chain as it was left: by
    /// these the shaft outside bows. Empty unless that wire is at rest.
    std::span<const HubLoad> loads() const {
        return loads_at_rest_ ? std::span<const HubLoad>(loads_) : std::span<const HubLoad>();
    }

    void state(StateStream& s) {
        s(relaxer_, working_, settling_, rest_, rest_loads_, rest_energy_, energy_, loads_, loads_at_rest_,
          asked_, made_, halvings_, spent_, pending_, refuses_, refused_, refused_for_push_, bears_);
    }

    /// Updates that all tries of one motion may take together: of a pull 1e6, a tenth of a second, for a wire
    /// must come back; of any other 600 passes over the wire, some 200 steps of Newton's method, and from
    /// 140 000 to 1e6.
    static int most_work(const Chain&, const HubMotion&);
    /// The same to bring a wire to rest where it lies, which may be laid anew.
    static constexpr int most_settling = 1'000'000;

    static constexpr double largest_turn = 10 * degree;  // of one part [rad]

private:
    void start_part(Chain&, int updates, HubReport&);
    HubReport finish(Chain&, int updates, HubReport);
    bool refuses(const Chain&, const HubMotion&) const;
    int work_of_try(const Chain&) const;
    bool buckles(const Chain&) const;
    void find_loads(const Chain&, const RelaxReport&);
    bool can_be(const RelaxReport&) const;
    double energy_of(const Chain&) const;

    GlobalRelaxer relaxer_;
    const LumenWall& wall_;
    bool working_ = false, settling_ = false;
    Chain rest_;                           // where the motion began
    double rest_energy_ = 0, energy_ = 0;  // then, and with `loads_` [N·mm]
    std::vector<HubLoad> rest_loads_;      // of each device
    std::vector<HubLoad> loads_;           // after what was tried, or of the wire as it was left
    bool loads_at_rest_ = false;
    HubMotion asked_, made_;
    int halvings_ = 0;
    int spent_ = 0;         // updates of the motion so far
    bool pending_ = false;  // the try has not begun
    bool refuses_ = false;  // `refused_`, and what is like it, of the last rest
    HubMotion refused_;
    bool refused_for_push_ = false;
    std::array<double, most_devices> bears_ = {};  // [N]; 0 = by the device's own buckling_force
};

}  // namespace physics
