#pragma once
/// Quadratic model of the wire's energy about an accepted state, for a window of its distal segments, and the
/// rollout of its minimum.

#include <array>
#include <vector>

#include "physics/relax/contact_set.h"
#include "physics/relax/newton_terms.h"
#include "physics/relax/riccati.h"

namespace physics {

class NewtonModel {
public:
    // Material frames of the accepted state, where its tip is curved; code that changes the wire must update
    // them.
    std::vector<Vec3> directors;
    double least_pivot = 0;  // least value of a shifted pivot [N·mm]

    int first() const { return terms_.first; }  // segment that the window starts with
    const NewtonTerms& terms() const { return terms_; }
    int stages() const { return static_cast<int>(terms_.stages.size()); }

    /// Prepares scratch for a wire of this many segments and the forces to start from. No segment at rest
    /// passes on more than C/λ, under which a joint would buckle by itself: a larger force comes from a joint
    /// that has just been put into a stiff wall. Up to joint `foreseen` the forces are those of
    /// foresee_forces().
    void start(const Guidewire&, const ContactSet&, int foreseen = 0);

    /// The model at the wire as it is, and its minimum with the trust region μ.
    RiccatiReport linearise(const Guidewire&, const ContactSet&, int first, double mu);
    /// Gradient proximal of the window.
    void sum_proximal(const Guidewire& wire, const ContactSet& contacts) {
        physics::sum_proximal(wire, contacts.contacts(), terms_);
    }
    /// Whether the last linearise() is the energy's own second order at μ = 0 over the whole wire, so that
    /// its pivots certify a minimum.
    bool certifies() const { return terms_.first == 1 && terms_.exact && mu_ == 0; }
    /// The same for the whole wire, by a pass of its own. The gains are then the whole wire's.
    RiccatiReport certify(const Guidewire&, const ContactSet&);

    /// The wall's part of the model at the accepted state. With foreseen forces, these replace stiffness
    /// times penetration in the second-order terms, which in a stiff wall is far too large while the wire
    /// settles; a contact that bears a force then counts as touching.
    void take_contacts(const Guidewire&, const ContactSet&, int first, bool foreseen_forces);
    /// The same with the wall at the trial state: its normals there, and the contacts made and lost on the
    /// way.
    void take_trial_contacts(const Guidewire&, const ContactSet&);
    /// The minimum of the model after its wall has changed since linearise().
    void solve(const Guidewire&, double mu);

    /// The window starts at `first`; everything else stays as it was left.
    void look_from(int first) { terms_.first = first; }
    /// Whether the gains are those of the whole wire at rest, as answer() needs.
    bool answers() const { return answers_; }
    /// To be called when what the gains were made of has changed.
    void forget_answer() { answers_ = false; }
    /// The gains' steps become the answer to the `fed` segments. With μ > 0 the gains can no longer answer.
    void answer(const Guidewire&, std::span<const FedStage> fed, double mu);
    /// The same over the window at μ = 0, after the wall has changed.
    void answer_again(const Guidewire&, std::span<const FedStage> fed);

    /// Trial state: applies the gains from the window's base, where the material frame is turned by `twist`,
    /// with more wire in the fed stages (indices into all stages). Returns the largest move of a joint, not
    /// counting what is fed along its segment [mm]; infinity where the trial state is not finite, which
    /// must not be evaluated.
    double roll_out(const Guidewire&, double twist = 0, std::span<const FedStage> fed = {});
    /// Slope of the energy along the last rollout [N·mm] and its largest turn [rad].
    double slope() const { return slope_; }
    double largest_turn() const;
    /// Energy of the trial state, without what is proximal of the window [N·mm]; its contacts wait in the
    /// set.
    double evaluate(Guidewire&, ContactSet&);
    /// Takes each contact's force at the trial state from the model.
    void foresee_forces(const Guidewire&);
    /// Gives the wire the trial state.
    void take(Guidewire&);

    /// Only the segment of this stage turns by itself, the rest answers.
    void turn_one(int stage, const Vec2& by);
    /// Only the segment of this stage twists by itself, the rest answers [rad].
    void twist_one(int stage, double by);
    /// Only the shaft unwinds by itself, the rest answers [rad].
    void unwind(const Guidewire&, double by);

    void state(StateStream& s) {
        s(directors, least_pivot, mu_, answers_, terms_, gains_, planes_);
        if (!s.part(terms_.windup_stiffness != 0, turn_, twist_twist_)) turn_ = twist_twist_ = 0;
        if (!s.part(terms_.second, device_turns_)) device_turns_ = {};
        if (!s.part(terms_.each, twist_gains_, settled_)) twist_gains_.clear(), settled_.clear();
        if (!s.restores()) return;
        turns_.resize(planes_.size());
        trial_joints_.resize(planes_.size());
        trial_tangents_.resize(planes_.size());
        trial_twists_.resize(terms_.each ? planes_.size() : 0);
        trial_rolls_.resize(trial_twists_.size());
    }

private:
    void take_grips(const Guidewire&, int first);
    void solve_turn(const Guidewire&, double mu, RiccatiReport&);
    void answer_device_turns(const Guidewire&, double mu, RiccatiReport&);
    void turn_devices(Guidewire&) const;
    void answer_turn(const Guidewire&, double slope, double mu);
    void set_axial_forces(const Guidewire&);
    void take_contact(const WallContact&, int joint, const Vec3& moved, double force);
    double trial_grip_energy(const Guidewire&);
    std::span<RiccatiGain> window_gains() { return std::span(gains_).subspan(terms_.first - 1); }
    std::span<TwistGain> window_twist_gains() {
        return terms_.each ? std::span(twist_gains_).subspan(terms_.first - 1) : std::span<TwistGain>();
    }

    double mu_ = 0;
    bool answers_ = false;
    NewtonTerms terms_;
    std::vector<RiccatiGain> gains_;
    std::vector<ContactPlane> planes_;
    double turn_ = 0;                          // by which the shaft unwinds, so that the tip turns [rad]
    std::array<double, 2> device_turns_ = {};  // the same of each device of a chain [rad]
    Vec2 device_way_ = Vec2::Zero();           // along which they have the least curvature
    std::array<std::array<double, 2>, 2> unturned_ = {};  // roll and windup while a trial is evaluated
    double twist_twist_ = 0;  // curvature of the energy along it, all else answering [N·mm]
    // Where each segment twists.
    std::vector<TwistGain> twist_gains_;
    std::vector<Vec3> settled_;  // directors of the accepted state, while a trial is evaluated
    std::vector<double> trial_twists_, trial_rolls_;  // the latter of the material frames since then [rad]
    // Trial state of a rollout, from the window's most proximal joint on.
    std::vector<Vec3> trial_tangents_, trial_joints_;
    std::vector<Vec2> turns_;
    double slope_ = 0;
};

}  // namespace physics
