#pragma once
/// Newton on all segments at once with a trust region and a primal-dual wall: finds the equilibrium within
/// one frame. docs/solver.md derives it.
///
/// This class remembers the wire from call to call. What it goes by is elsewhere: Descent is the method,
/// NewtonStep one step of it, TrustRegion how long the step is, SofterWalls the way out of a dead end,
/// predict() where a wire starts from after a motion of the hub.

#include <span>

#include "physics/relax/contact_set.h"
#include "physics/relax/global_options.h"
#include "physics/relax/iterate.h"
#include "physics/relax/lagged_forces.h"
#include "physics/relax/relaxer.h"
#include "physics/relax/softer_walls.h"

namespace physics {

class GlobalRelaxer final : public Relaxer {
public:
    GlobalRelaxer(const RelaxerConfig&, const LumenWall&, const GlobalOptions& = {});

    /// Every pass of the recursion, including those of rejected trials, of predictions and of the softer
    /// walls that lead out of a dead end, is charged the segments of its window. A few passes are made even
    /// where the budget does not allow them: at most least_passes over the whole wire. The budget's distal
    /// share is not used: work starts at the tip by itself. Ends with the last accepted state in the wall
    /// itself and remembers it, so that a wire that comes back unchanged costs nothing, one that was only fed
    /// costs what its change costs, and a solve that its budget has cut goes on as if it had not been: the
    /// steps of many calls are those of one with the sum of their budgets, but for a few passes.
    RelaxReport relax(Chain&, const RelaxBudget&, const UpdateObserver& = {}) override;

    /// Takes a wire back to where it was at rest before: as relax(), but with its grips' forces held, which
    /// may have been left where no others agree (LaggedForces::update).
    RelaxReport recall(Chain&);

    /// Moves a wire at rest and lets it come to rest again; where it can, it starts from predict(). `motion`
    /// becomes what was made. A feed is at most λ.
    RelaxReport move(Chain&, HubMotion& motion, const RelaxBudget&);

    /// The wall is another from now on: the next call knows nothing of the wire.
    void forget();

    void state(StateStream& s) override {
        s(at_, predicted_, spent_, lag_, softer_walls_, contacts_, end_, end_report_);
    }

    /// Passes over the whole wire that one call may make beyond its budget.
    static constexpr int least_passes = 12;

    /// Whether the wire is as the last call left it, at rest.
    bool knows(const Chain&) const;
    /// Report of the last call, and the contacts of the wire's joints as that call left them.
    const RelaxReport& last_report() const { return end_report_; }
    std::span<const WallContact> contacts() const { return contacts_.contacts(); }

private:
    /// What of the wire is as the last call left it: proximal segments.
    struct Unchanged {
        int segments = 0;  // whose stages are
        int grips = 0;     // whose grips are
        bool all = false;
    };
    /// A wire whose rest is sought, through rounds of friction's normal forces.
    struct Search {
        Chain& wire;
        const UpdateObserver& observer;
        RelaxReport& report;
        DescentTask task;
    };

    bool predict_motion(Chain&, HubMotion&, int most_updates);
    Unchanged unchanged(const Chain&) const;
    const Foundation* vessels_that_move(const Chain& wire) const {
        return wire.vessels_stay ? nullptr : wall_.foundation();
    }
    RelaxReport nothing_to_do(int updates) const;
    void take_up_frames(const Chain&, int unchanged_segments);
    DescentTask take_up(Chain&, const Unchanged&, int most_updates);
    template <class Find>
    RelaxReport search(Chain&, int most_updates, const UpdateObserver&, Find);
    Termination find_equilibrium(Search&);
    Termination find_rest(Search&);
    void finish(Chain&, Termination, RelaxReport&);

    const GlobalOptions options_;
    const double tolerance_;  // largest |g|/C at rest [-]
    const LumenWall& wall_;
    const bool smooth_;
    Iterate at_;
    int predicted_ = 0;  // segments that the current motion changes the most
    int spent_ = 0;      // updates that its prediction has cost
    SofterWalls softer_walls_;
    LaggedForces lag_;  // its rounds over calls that ended with their budget
    ContactSet contacts_;
    // How the last call ended.
    Chain end_;
    RelaxReport end_report_;
};

}  // namespace physics
