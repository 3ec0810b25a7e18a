#pragma once
/// Newton on all segments at once with a trust region and a primal-dual wall: finds the equilibrium within
/// one frame.
///
/// Each step solves a quadratic model of the wire by the Riccati recursion, rolls it out, and is accepted
/// only where the true energy falls enough (Armijo). Where it does not, the wall's part of the model is made
/// again with the wall as it is at the trial state. A stiff, curved wall needs that: a wire that moves along
/// the tangent plane of a contact departs from the wall, or enters it, by a second-order distance. A step
/// that would move a joint by more than 0.3 of the lumen's radius is computed again with a stiffer trust
/// region; a step that is scaled down instead folds the wire.
///
/// Steps move a window of distal segments: those that changed since the last call, and as many proximal of
/// them as feel the change.

#include <cmath>
#include <vector>

#include "physics/relax/contact_set.h"
#include "physics/relax/newton_model.h"
#include "physics/relax/relaxer.h"

namespace physics {

class GlobalRelaxer final : public Relaxer {
public:
    GlobalRelaxer(const RelaxerConfig& config, const LumenWall& wall)
        : config_(config),
          tolerance_(config.tolerance),
          wall_(wall),
          smooth_(wall.smooth()),
          contacts_(wall) {}

    /// Every pass of the recursion, including those of rejected trials, of predictions and of the softer
    /// walls that lead out of a dead end, is charged the segments of its window. A few passes are made even
    /// where the budget does not allow them: at most least_passes over the whole wire. The budget's distal
    /// share is not used: work starts at the tip by itself. Ends with the last accepted state in the wall
    /// itself and remembers it, so that a wire that comes back unchanged costs nothing, one that was only fed
    /// costs what its change costs, and a solve that its budget has cut goes on as if it had not been: the
    /// steps of many calls are those of one with the sum of their budgets, but for a few passes.
    RelaxReport relax(Guidewire&, const RelaxBudget&, const UpdateObserver& = {}) override;

    /// Moves a wire at rest and lets it come to rest again. The wire starts from its whole first-order answer
    /// to the motion, wall and twist included: this is far nearer its new rest than where it would merely
    /// slide on. Where the answer moves a joint farther than the model is good for, less of the motion is
    /// made; `motion` becomes what was made. A feed is at most λ.
    RelaxReport move(Guidewire&, HubMotion& motion, const RelaxBudget&);

    void state(StateStream& s) override {
        s(mu_, mu_unit_, energy_, load_scale_, idle_, model_, pivots_, foreseen_, predicted_, spent_,
          contacts_, end_, end_report_);
        if (!s.part(lag_rounds_ > 0, lag_rounds_)) lag_rounds_ = 0;
        // Only a solve that goes on needs to know how far it has come.
        if (!s.part(end_report_.out_of_budget, best_)) best_ = 0;
        if (!s.part(softening_.stiffness > 0, softening_)) softening_ = {};
    }

    /// Passes over the whole wire that one call may make beyond its budget.
    static constexpr int least_passes = 12;

    /// Whether the wire is as the last call left it, at rest.
    bool knows(const Guidewire&) const;
    /// Report of the last call, and the contacts of the wire's joints as that call left them.
    const RelaxReport& last_report() const { return end_report_; }
    std::span<const WallContact> contacts() const { return contacts_.contacts(); }

private:
    bool predict(Guidewire&, HubMotion&, int most_updates);
    double try_answer(Guidewire&, const FeedPlan&, double turn, double mu, double cap, double seen_rise);
    enum class Outcome { Converged, OutOfBudget, Stuck };
    enum class Trial { Accepted, OutOfBudget, NothingLower };
    Outcome descend(Guidewire&, ContactSet&, int most_updates, int valid, int first_window, RelaxReport&,
                    const UpdateObserver&);
    Outcome descend_in_softer_walls(Guidewire&, int most_updates, RelaxReport&, const UpdateObserver&);
    void set_units(const Guidewire&, const ContactSet&);
    void look_at(const Guidewire&);
    Trial step(Guidewire&, ContactSet&, int most_updates, RelaxReport&);
    bool leave_saddle(Guidewire&, ContactSet&);
    void open_window(const Guidewire&, const ContactSet&, int segments);
    void linearise(const Guidewire&, const ContactSet&, int first);
    void measure_window(const Guidewire&, const ContactSet&);
    void accept(Guidewire&, ContactSet&, double energy);
    Outcome find_rest(Guidewire&, int most_updates, int valid, int first_window, RelaxReport&,
                      const UpdateObserver&);
    bool update_grips(Guidewire&) const;
    int unchanged_segments(const Guidewire&) const;
    int unchanged_grips(const Guidewire&) const;
    double energy_scale() const { return std::abs(energy_) + load_scale_; }

    RelaxerConfig config_;
    double tolerance_ = 0;  // of the descent under way
    const LumenWall& wall_;
    bool smooth_;
    double mu_ = 0, mu_unit_ = 0;  // trust region and its natural size [N/mm²]
    double energy_ = 0;            // of the window's accepted state; a load makes it negative [N·mm]
    double load_scale_ = 0;        // of the load's part of it [N·mm]
    int idle_ = 0;                 // consecutive steps that led nowhere
    double best_ = 0;              // least gradient of the window so far, over C
    bool goes_on_ = false;         // the next descent continues one that its budget has cut
    NewtonModel model_;
    RiccatiReport pivots_;  // of the model
    // How the last call ended.
    int foreseen_ = 0;    // joints whose forces the prediction has foreseen
    int predicted_ = 0;   // segments that the current motion changes the most
    int spent_ = 0;       // updates that its prediction has cost
    int lag_rounds_ = 0;  // so far, over calls that ended with their budget
    /// A wire on its way through softer walls; the one that is asked for stays where it was stuck.
    struct Softening {
        double stiffness = 0;  // of the wall it is in now, 0 = none is under way [N/mm]
        double energy = 0;     // where the wire was stuck [N·mm]
        int spent = 0;         // updates in this wall
        Guidewire wire;
        void state(StateStream& s) { s(stiffness, energy, spent, wire); }
    };
    Softening softening_;
    ContactSet contacts_;
    Guidewire end_;
    RelaxReport end_report_;
};

}  // namespace physics
