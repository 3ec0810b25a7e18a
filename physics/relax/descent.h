#pragma once
/// Newton's method from where a wire is to an equilibrium, in one wall whose grips hold with fixed forces.

#include <optional>

#include "physics/relax/global_options.h"
#include "physics/relax/iterate.h"
#include "physics/relax/relaxer.h"

namespace physics {

/// What a descent is asked for.
struct DescentTask {
    int most_updates = 0;   // of the report's
    int valid = 0;          // stages of segments up to this one are still those of the model
    int first_window = 1;   // segments
    double tolerance = 0;   // largest |g|/C at rest [-]
    bool certifies = true;  // whether a rest is to be a minimum
};

/// Moves a window of distal segments. Where its gradient is small against the one proximal of it, the window
/// is widened, until the whole wire is at rest; that is then certified by the pivots of one pass over all
/// segments, and a saddle left along its negative curvature.
class Descent {
public:
    Descent(Iterate&, Chain&, ContactSet&, const GlobalOptions&, bool smooth_wall, const DescentTask&,
            RelaxReport&, const UpdateObserver&);

    /// StrictMinimum or Stationary at rest; OutOfBudget; Stuck where no step leads on. The wire is in its
    /// last accepted state, and the iterate's model is that state's unless it is Stuck.
    Termination run();

private:
    using End = std::optional<Termination>;  // empty: the descent goes on

    void start();
    void sum_proximal();
    void look_proximal();
    bool at_rest() const;
    bool settled() const;
    End certify();
    End widen();
    End take_step();
    bool leads_nowhere(double progress, int idle_before);
    bool leave_saddle();
    bool turn_down(double angle);
    void open(int segments);
    void begin_window();
    void advance();

    const NewtonTerms& terms() const { return at_.model.terms(); }
    double gradient() const;
    bool is_first_step() const { return report_.newton_steps == steps_before_; }
    bool affordable(int updates) const {
        return is_first_step() || report_.updates + updates <= task_.most_updates;
    }

    Iterate& at_;
    Chain& wire_;
    ContactSet& contacts_;
    const GlobalOptions& options_;
    const bool smooth_;
    const DescentTask task_;
    RelaxReport& report_;
    const UpdateObserver& observer_;
    const int segments_, steps_before_;
    bool proximal_known_ = true;  // the gradient proximal of the window is the accepted state's
    double looked_at_ = 0;        // |g|/C in the window when it was summed [-]
};

}  // namespace physics
