#pragma once
/// Newton on all segments at once with a trust region and a primal-dual wall: the equilibrium inside one
/// frame.
///
/// Each step solves a quadratic model of the wire by the Riccati recursion, rolls it out, and is accepted
/// only where the true energy falls enough (Armijo). Where it does not, the wall's part of the model is made
/// again with the wall as it is at the trial state, which is what a stiff, curved wall asks for: along the
/// tangent plane of a contact a wire leaves the wall, or runs into it, to second order. A step that would
/// carry a joint past 0.3 of the lumen's radius is made again with a stiffer trust region rather than cut
/// short, since cutting short folds the wire.
///
/// Steps move a window of distal segments: those that changed since the last call and as many more proximal
/// of them as feel it.

#include <cmath>
#include <optional>
#include <vector>

#include "physics/contact_set.h"
#include "physics/newton_terms.h"
#include "physics/relaxer.h"

namespace physics {

class GlobalRelaxer final : public Relaxer {
public:
    explicit GlobalRelaxer(const RelaxerConfig& config) : config_(config) {}

    /// A step is charged the segments of its window; one is made even where the budget's updates do not
    /// allow it. The budget's distal share is not needed: work starts at the tip by itself. Ends with the
    /// last accepted state. Remembers that state, so that a wire which comes back as it went costs nothing.
    RelaxReport relax(Guidewire&, const LumenWall&, const RelaxBudget&, const UpdateObserver& = {}) override;

private:
    enum class Outcome { Converged, OutOfBudget, Stuck };
    Outcome descend(Guidewire&, ContactSet&, const RelaxBudget&, int window, RelaxReport&,
                    const UpdateObserver&);
    void set_units(const Guidewire&, const ContactSet&);
    bool step(Guidewire&, ContactSet&, RelaxReport&);
    bool leave_saddle(Guidewire&, ContactSet&, const RiccatiReport&);
    void open_window(const Guidewire&, const ContactSet&, int segments);
    void linearise(const Guidewire&, const ContactSet&);
    void settle_forces(const Guidewire&, const ContactSet&);
    void foresee_forces(const Guidewire&);
    void model_contacts(const ContactSet&, bool foreseen_forces);
    void model_trial_contacts(const Guidewire&, const ContactSet&);
    void model_contact(const WallContact&, int joint, const Vec3& moved, double force);
    void model_axial_force(const Guidewire&);
    double roll_out(const Guidewire&);
    double evaluate(Guidewire&, ContactSet&);
    void accept(Guidewire&, ContactSet&, double energy);
    int changed_segments(const Guidewire&) const;
    double energy_scale() const { return std::abs(energy_) + load_scale_; }

    RelaxerConfig config_;
    int first_ = 1;                // segment that the window starts with
    double mu_ = 0, mu_unit_ = 0;  // trust region and its natural size [N/mm²]
    double least_pivot_ = 0;       // that a shifted one becomes [N·mm]
    double energy_ = 0;            // of the window's accepted state; a load makes it negative [N·mm]
    double load_scale_ = 0;        // of the load's part of it [N·mm]
    NewtonTerms terms_;
    std::vector<RiccatiGain> gains_;
    // The model's contacts, per joint: penetration = gap + normal·(x − x_accepted).
    struct Plane {
        double gap = 0, stiffness = 0;
        Vec3 normal = Vec3::Zero();
        double force = 0;  // foreseen by the last rollout [N]
    };
    std::vector<Plane> planes_;
    // Trial state of a rollout, from joint first_ − 1 on.
    std::vector<Vec3> trial_tangents_, trial_joints_, directors_;
    std::vector<Vec2> turns_;
    double slope_ = 0;  // of the energy along the last rollout [N·mm]
    // How the last call ended.
    const LumenWall* wall_ = nullptr;
    std::optional<ContactSet> contacts_;
    Guidewire end_;
    RelaxReport end_report_;
};

}  // namespace physics
