#pragma once
/// Quadratic model of the wire's energy about an accepted state, for a window of its distal segments, and the
/// rollout of its minimum.

#include <array>
#include <optional>
#include <vector>

#include "physics/relax/contact_set.h"
#include "physics/relax/newton_terms.h"
#include "physics/relax/riccati.h"

namespace physics {

class NewtonModel {
public:
    // The chain's directors in the accepted state, where a device is bent; code that changes the chain must
    // update them.
    std::vector<Vec3> directors;
    double least_pivot = 0;  // least value of a shifted pivot [N·mm]
    double slips_on = 0;     // StepOptions::slips_on

    int first() const { return terms_.first; }  // segment that the window starts with
    const NewtonTerms& terms() const { return terms_; }
    int stages() const { return static_cast<int>(terms_.stages.size()); }

    /// Prepares scratch for a wire of this many segments and the forces to start from. No segment at rest
    /// passes on more than C/λ, under which a joint would buckle by itself: a larger force comes from a joint
    /// that has just been put into a stiff wall. Up to joint `foreseen` the forces are those of
    /// predict_contact_forces().
    void start(const Chain&, const ContactSet&, int foreseen = 0);
    /// The same with these forces of the joints [N].
    void start_with(const Chain&, std::span<const double> forces);

    /// The model at the wire as it is, and its minimum with the trust region μ.
    RiccatiReport linearise(const Chain&, const ContactSet&, int first, double mu);
    /// Gradient proximal of the window.
    void sum_proximal(const Chain& wire, const ContactSet& contacts) {
        physics::sum_proximal(wire, contacts.contacts(), terms_);
    }
    /// Whether the last linearise() is the energy's own second order at μ = 0 over the whole wire, so that
    /// its pivots certify a minimum.
    bool certifies() const { return terms_.first == 1 && terms_.exact && mu_ == 0; }
    /// The same for the whole wire, by a pass of its own. The gains are then the whole wire's.
    RiccatiReport certify(const Chain&, const ContactSet&);

    /// The wall's part of the model at the accepted state. With foreseen forces, these replace stiffness
    /// times penetration in the second-order terms, which in a stiff wall is far too large while the wire
    /// settles; a contact that bears a force then counts as touching.
    void take_contacts(const Chain&, const ContactSet&, int first, bool predicted_contact_forces);
    /// The same with the wall at the trial state: its normals there, and the contacts made and lost on the
    /// way.
    void take_trial_contacts(const Chain&, const ContactSet&);
    /// The minimum of the model after its wall has changed since linearise().
    void solve(const Chain&, double mu);

    /// The window starts at `first`; everything else stays as it was left.
    void look_from(int first) { terms_.first = first; }
    /// Whether the gains are those of the whole wire at rest, as answer() needs.
    bool answers() const { return answers_; }
    /// The gradient becomes that of the chain as it is now, which has only been fed or turned since.
    void update_slopes(const Chain& chain, const ContactSet& contacts) {
        physics::update_slopes(chain, contacts.contacts(), directors, terms_);
    }
    /// The gains' steps become the answer to the gradient and to the `fed` segments. With μ > 0 the gains can
    /// no longer answer.
    void answer(const Chain&, std::span<const FedStage> fed, double mu);
    /// The same over the window at μ = 0, after the wall has changed.
    void answer_again(const Chain&, std::span<const FedStage> fed);

    /// Trial state: applies the gains from the window's base, with more wire in the fed stages (indices into
    /// all stages). Returns the largest move of a joint, not counting what is fed along its segment [mm];
    /// infinity where the trial state is not finite, which must not be evaluated.
    double roll_out(const Chain&, std::span<const FedStage> fed = {});
    /// Keeps the trial state, to go back to.
    void keep_trial() { kept_ = trial_; }
    void restore_trial() { std::swap(trial_, kept_); }
    /// Slope of the energy along the last rollout [N·mm] and its largest turn [rad].
    double slope() const { return trial_.slope; }
    double largest_turn() const;
    /// Energy of the trial state, without what is proximal of the window [N·mm]; its contacts wait in the
    /// set.
    double evaluate(Chain&, ContactSet&);
    /// The contacts alone.
    void ask_trial(ContactSet& contacts) const { contacts.evaluate(trial_.joints, terms_.first); }
    const Vec3& trial_tip() const { return trial_.joints.back(); }
    /// [j] = what the gradient of segment j adds, by the step to the model's minimum, to the tip's move along
    /// this direction [mm]; [0] unused. Of a model that was made by linearise() over the whole chain at μ =
    /// 0.
    std::vector<double> parts_along(const Chain&, const Vec3& direction) const;
    /// [j] = how far joint j of a chain at rest moves, to first order, where the chain becomes `changed`, of
    /// the same joints and with these contacts [mm]. Of a model of the chain at rest, made as above. Empty
    /// where the answer is not finite.
    std::optional<std::vector<Vec3>> moved_by(const Chain& rest, const Chain& changed,
                                              const ContactSet&) const;
    /// The same where the wall at each joint, with its grip, has moved by so much [mm].
    std::optional<std::vector<Vec3>> moved_with(const Chain& rest, std::span<const Vec3> walls) const;
    /// The same where the energy's gradient has grown by so much at each joint that touches [N].
    std::optional<std::vector<Vec3>> pushed_by(const Chain& rest, std::span<const Vec3> gradients) const;
    /// Of each joint, as the model has its contact.
    std::span<const ContactPlane> planes() const { return planes_; }
    /// Takes each contact's force at the trial state from the model.
    void predict_contact_forces(const Chain&);
    /// Gives the wire the trial state.
    void take(Chain&);

    /// Only the segment of this stage turns by itself, the rest answers.
    void turn_one(int stage, const Vec2& by);
    /// Only the segment of this stage twists by itself, of that frame, the rest answers [rad].
    void twist_one(int stage, int frame, double by);
    /// Only the shafts unwind by themselves, the rest answers [rad].
    void unwind(double by);

    /// Whether the frames of the model are those of the chain.
    bool has_frames_of(const Chain& wire) const { return terms_.frames == Frames(wire); }

    void state(StateStream& s) {
        s(directors, least_pivot, slips_on, mu_, answers_, terms_, gains_, frame_gains_, planes_,
          trial_.turns_at_base, base_curve_, settled_);
        if (!s.restores()) return;
        trial_.turns.resize(planes_.size());
        trial_.joints.resize(planes_.size());
        trial_.tangents.resize(planes_.size());
        size_twists(planes_.size());
    }

private:
    template <class Terms>
    void take_grips(const Chain&, int first, const Terms&);
    GripTerms trial_grip(const Grip&, const Vec3& joint, int j) const;
    void turn_base(const Chain&, double mu, RiccatiReport&);
    FrameVector with_springs(const Chain&, FrameVector slopes) const;
    void forget_gradient();
    double answer_in_small(const Chain&, FrameVector springs);
    std::optional<std::vector<Vec3>> moves_in_small(const Chain&, const FrameVector& springs);
    void solve_base(const Chain&, const FrameVector& slope, double mu, RiccatiReport*);
    void turn_devices(Chain&) const;
    void size_for(const Chain&);
    void size_twists(std::size_t joints);
    void set_axial_forces(const Chain&);
    void take_contact(const WallContact&, int joint, const Vec3& moved, double force);
    template <int F>
    double roll_out(const Chain&, std::span<const FedStage> fed);
    template <int F>
    double twist_out(const Chain&, int j, const Vec3& moved, const Vec2& alpha, FrameVector& twist,
                     FrameVector& wound);
    double trial_grip_energy(const Chain&);
    std::span<RiccatiGain> window_gains() { return std::span(gains_).subspan(terms_.first - 1); }

    double mu_ = 0;
    bool answers_ = false;
    NewtonTerms terms_;
    std::vector<RiccatiGain> gains_;
    std::vector<FrameGain> frame_gains_;
    std::vector<ContactPlane> planes_;
    FrameVector base_direction_ = {};  // along which they have the least curvature
    FrameMatrix base_curve_ = {};      // of the energy by the frames' turns, all else answering [N·mm]
    // Where devices twist segment by segment.
    std::vector<Vec3> settled_;  // directors of the accepted state, while a trial is evaluated
    /// What a rollout leads to, from the window's most proximal joint on.
    struct Trial {
        std::vector<Vec3> tangents, joints;
        std::vector<Vec2> turns;
        double slope = 0;
        FrameVector turns_at_base = {};  // by which shafts unwind, so that their frames turn [rad]
        // Where devices twist segment by segment.
        std::array<std::vector<double>, most_devices> wound;  // of each device
        std::vector<double> rolls;  // of the outermost devices' material since the accepted state [rad]
    };
    Trial trial_, kept_;
};

}  // namespace physics
