#pragma once
/// Newton on all segments at once with a trust region and semismooth contacts: the equilibrium inside one
/// frame.
///
/// Each step solves the quadratic model of the whole wire by the Riccati recursion, rolls it out, and is
/// accepted only where the true energy falls enough (Armijo). A step that would carry a joint past 0.3 of the
/// lumen's radius is made again with a stiffer trust region rather than cut short, since cutting short folds
/// the wire.

#include <vector>

#include "physics/contact_set.h"
#include "physics/newton_terms.h"
#include "physics/relaxer.h"

namespace physics {

class GlobalRelaxer final : public Relaxer {
public:
    explicit GlobalRelaxer(const RelaxerConfig& config) : config_(config) {}

    /// The budget's updates allow updates/N Newton steps, at least one; its distal share is not needed: work
    /// starts at the tip by itself. Ends with the last accepted state.
    RelaxReport relax(Guidewire&, const LumenWall&, const RelaxBudget&, const UpdateObserver& = {}) override;

private:
    enum class Outcome { Converged, OutOfBudget, Stuck };
    Outcome descend(Guidewire&, ContactSet&, int most_steps, RelaxReport&, const UpdateObserver&);
    bool step(Guidewire&, ContactSet&, RelaxReport&);
    bool leave_saddle(Guidewire&, ContactSet&, const RiccatiReport&);
    void load(const Guidewire&, const ContactSet&);
    bool predict_contacts(const ContactSet&);
    void restore_contacts(const ContactSet&);
    void set_contact(const WallContact&, int joint, bool active);
    double roll_out(const Guidewire&, double share);
    double evaluate(Guidewire&, ContactSet&);
    void accept(Guidewire&, ContactSet&, double energy);

    RelaxerConfig config_;
    double mu_ = 0, mu_unit_ = 0;  // trust region and its natural size [N/mm²]
    double energy_ = 0;            // of the accepted state [N·mm]
    NewtonTerms terms_;
    std::vector<RiccatiGain> gains_;
    // trial state of a rollout
    std::vector<Vec3> trial_tangents_, trial_joints_, directors_;
    std::vector<Vec2> turns_;
    std::vector<char> active_;  // joint is modelled as touching
    double slope_ = 0;          // of the energy along the last rollout [N·mm]
};

}  // namespace physics
