#include "physics/global_relaxer.h"

#include <algorithm>
#include <cmath>

#include "physics/bending.h"

namespace physics {
namespace {

constexpr double kCap = 0.3;          // largest joint move of a step, in lumen radii
constexpr double kKinkedCap = 0.03;   // of a wire with a kink, which leads to many rests
constexpr double kFree = 1e9;         // room of a joint that knows no lumen [mm]
constexpr int kCorrections = 4;       // backward passes for one trust region, the wall corrected between them
constexpr int kTrustPasses = 40;      // changes of μ for one step
constexpr int kForeseenPasses = 2;    // of them with foreseen forces
constexpr double kArmijo = 1e-4;      // share of the slope that the energy must fall by
constexpr double kGoodArmijo = 0.2;   // the same as long as the wall can still be corrected
constexpr double kTrustGrowth = 0.1;  // of μ after a step well inside its cap
constexpr double kForgetTrust = 1e-8;  // μ below this share of its unit is none
constexpr double kRounding = 1e-13;    // of the energy: less than this a line search can't see
constexpr double kProgress = 1e-4;  // of the energy: a step that falls by less is idle, if the gradient stays
constexpr int kIdleSteps = 40;      // of them before the wall is made softer
constexpr int kIdleStepsOnPlanes = 40;   // before a wall whose planes jump is left as it is
constexpr double kSoft = 1.0;            // k λ²/C that always converges; continuation starts there
constexpr double kLeastPivot = 1e-6;     // of a recursion, over C
constexpr double kKick = 1e-3;           // turn that leaves a saddle [rad]
constexpr double kSettled = 0.01;        // |dU/du| in a window over that proximal of it: time to widen
constexpr int kWidening = 4;             // of a window
constexpr int kLeastWindow = 32;         // segments
constexpr int kChangedShare = 2;         // segments of a window for each that changed
constexpr int kMargin = 8;               // segments of the window proximal of those
constexpr double kPredictedCap = 1;      // largest joint move of a prediction, in lumen radii
constexpr double kPredictedRise = 1;     // of the energy, by a prediction
constexpr double kPredictedWork = 4;     // of the hand's work
constexpr double kLeastPredicted = 0.1;  // of a motion that is predicted
constexpr int kPredictedWindow = 64;     // segments
constexpr double kFallen = 0.1;  // of |dU/du| in the window: time to look at that proximal of it again

/// A wall made softer, for the continuation in stiffness.
class SofterWall final : public LumenWall {
public:
    SofterWall(const LumenWall& wall, double share) : wall_(wall), share_(share) {}
    void contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        wall_.contacts(joints, contacts);
        for (WallContact& c : contacts) c.share_stiffness(share_);
    }
    bool same_vessel(int a, int b) const override { return wall_.same_vessel(a, b); }

private:
    const LumenWall& wall_;
    double share_;
};

/// Cosine of the angle of a joint away from its rest shape.
double straightness(const Guidewire& wire, const std::vector<Vec3>& d, int joint) {
    if (wire.rest_angle[joint] == 0) return wire.tangents[joint].dot(wire.tangents[joint + 1]);
    return rest_direction(wire, joint, d[joint]).dot(wire.tangents[joint + 1]);
}

/// Whether a joint from `first` on turns by more than 60°.
bool kinked(const Guidewire& wire, int first) {
    for (int j = first; j < wire.segments(); ++j)
        if (wire.tangents[j].dot(wire.tangents[j + 1]) < 0.5) return true;
    return false;
}

}  // namespace

/// Terms of the accepted state.
void GlobalRelaxer::linearise(const Guidewire& wire, const ContactSet& contacts, bool proximal) {
    if (wire.curved_segments() > 0) transport_directors(wire, first_, directors_);
    assemble(wire, contacts.contacts(), directors_, first_, terms_, proximal);
}

void GlobalRelaxer::measure_window(const Guidewire& wire, const ContactSet& contacts) {
    energy_ = contacts.energy(wire.joints, first_);
    for (int j = first_ - 1; j < wire.segments(); ++j) energy_ += joint_energy(wire, directors_, j);
    load_scale_ = contacts.load_scale(first_);
}

void GlobalRelaxer::open_window(const Guidewire& wire, const ContactSet& contacts, int segments) {
    first_ = std::max(1, wire.segments() - segments + 1);
    linearise(wire, contacts);
    measure_window(wire, contacts);
}

/// Forces to start from. No segment at rest passes on more than C/λ, under which a joint would buckle by
/// itself: a larger force is that of a joint which has just been put into a stiff wall.
void GlobalRelaxer::settle_forces(const Guidewire& wire, const ContactSet& contacts) {
    planes_.assign(wire.joints.size(), {});
    for (int j = 1; j <= wire.segments(); ++j)
        if (const WallContact& c = contacts.contacts()[j]; c.touches())
            planes_[j].force = std::min(c.force(), wire.spring_constant(j - 1) / wire.lengths[j]);
}

/// What the model of the last rollout makes of each contact's force.
void GlobalRelaxer::foresee_forces(const Guidewire& wire) {
    for (int j = first_; j <= wire.segments(); ++j) {
        Plane& p = planes_[j];
        const double depth = p.gap + p.normal.dot(trial_joints_[j] - wire.joints[j]);
        p.force = terms_.stages[j - 1].touches ? p.stiffness * std::max(0.0, depth) : 0.0;
    }
}

/// The wall's part of the model at the accepted state. With foreseen forces in the second-order terms, in
/// place of stiffness times penetration, which in a stiff wall is far too large while the wire settles; what
/// bears a force then counts as touching.
void GlobalRelaxer::model_contacts(const ContactSet& contacts, bool foreseen_forces) {
    for (int j = first_; j < static_cast<int>(planes_.size()); ++j) {
        const WallContact& c = contacts.contacts()[j];
        const double force = foreseen_forces ? planes_[j].force : c.force();
        terms_.stages[j - 1].touches = false;
        if (c.touches() || force > 0) model_contact(c, j, Vec3::Zero(), force);
    }
}

/// The same with the wall as it is at the trial state: the normals there, and the contacts made and lost on
/// the way.
void GlobalRelaxer::model_trial_contacts(const Guidewire& wire, const ContactSet& contacts) {
    foresee_forces(wire);
    for (int j = first_; j <= wire.segments(); ++j) terms_.stages[j - 1].touches = false;
    for (std::size_t k = 0; k < contacts.asked().size(); ++k) {
        const WallContact& c = contacts.answers()[k];
        const int j = contacts.asked()[k];
        const double force = planes_[j].force;
        if (c.touches() || force > 0) model_contact(c, j, trial_joints_[j] - wire.joints[j], force);
    }
}

/// A contact's terms of second order about the place where the wall was asked, `moved` from the accepted
/// joint.
void GlobalRelaxer::model_contact(const WallContact& c, int joint, const Vec3& moved, double force) {
    RiccatiStage& s = terms_.stages[joint - 1];
    Plane& p = planes_[joint];
    p = {c.penetration - c.normal.dot(moved), c.stiffness, c.normal, force};
    s.touches = true;
    s.stiffness = c.stiffness * c.normal * c.normal.transpose() + force * c.curvature;
    s.force = c.stiffness * p.gap * c.normal - force * (c.curvature * moved) + c.stiffening_push();
}

void GlobalRelaxer::model_axial_force(const Guidewire& wire) {
    const bool loaded = !wire.load.isZero(0);
    Vec3 force = Vec3::Zero();
    for (int j = wire.segments(); j >= first_; --j) {
        RiccatiStage& s = terms_.stages[j - 1];
        if (s.touches) force += planes_[j].force * planes_[j].normal;
        if (loaded) force -= wire.length_of(j) * wire.load;
        s.axial = s.length * wire.tangents[j].dot(force);
    }
}

/// Trial state: gains applied from the window's base, where the material frame is turned by `twist`, with
/// more wire in the stages that are fed. Returns the largest move of a joint, that along its segment by what
/// is fed left out [mm].
double GlobalRelaxer::roll_out(const Guidewire& wire, double twist, std::span<const FedStage> fed) {
    const int n = wire.segments();
    trial_joints_[first_ - 1] = wire.joints[first_ - 1];
    trial_tangents_[first_ - 1] = wire.tangents[first_ - 1];
    turns_[first_ - 1].setZero();
    double farthest = 0, slid = 0;
    slope_ = 0;
    for (int j = first_; j <= n; ++j) {
        const RiccatiStage& s = terms_.stages[j - 1];
        const RiccatiGain& gain = gains_[j - 1];
        Vec2 alpha = gain.step;
        alpha.noalias() += gain.from_x * (trial_joints_[j - 1] - wire.joints[j - 1]);
        alpha.noalias() += gain.from_prev * turns_[j - 1];
        if (terms_.twist) {
            alpha += gain.from_twist * twist;
            twist += s.twist_prev.dot(turns_[j - 1]) + s.twist.dot(alpha);
        }
        turns_[j] = alpha;
        slope_ += terms_.gradient[j - 1].dot(alpha);
        trial_tangents_[j] = (wire.tangents[j] + s.basis * alpha).normalized();
        double length = s.length;
        for (const FedStage& f : fed) {
            if (f.stage != j - 1) continue;
            const double by = f.by.dot(wire.tangents[j]);
            length += by, slid += by;
        }
        trial_joints_[j] = trial_joints_[j - 1] + length * trial_tangents_[j];
        Vec3 moved = trial_joints_[j] - wire.joints[j];
        if (slid != 0) moved -= slid * wire.tangents[j];
        farthest = std::max(farthest, moved.squaredNorm());
    }
    return std::sqrt(farthest);
}

/// Energy of the window's trial state; its contacts wait in the set.
double GlobalRelaxer::evaluate(Guidewire& wire, ContactSet& contacts) {
    double energy = contacts.evaluate(trial_joints_, first_);
    std::swap(wire.tangents, trial_tangents_);
    if (terms_.twist) transport_directors(wire, first_, directors_);
    for (int j = first_ - 1; j < wire.segments(); ++j) energy += joint_energy(wire, directors_, j);
    std::swap(wire.tangents, trial_tangents_);
    return energy;
}

void GlobalRelaxer::accept(Guidewire& wire, ContactSet& contacts, double energy) {
    std::copy(trial_tangents_.begin() + first_, trial_tangents_.end(), wire.tangents.begin() + first_);
    std::copy(trial_joints_.begin() + first_, trial_joints_.end(), wire.joints.begin() + first_);
    contacts.commit();
    energy_ = energy;
}

/// One Newton step.
GlobalRelaxer::Trial GlobalRelaxer::step(Guidewire& wire, ContactSet& contacts, int most_updates,
                                         RelaxReport& report) {
    const double part = kinked(wire, first_ - 1) ? kKinkedCap : kCap;
    double cap = kFree;
    for (const WallContact& c : contacts.contacts().subspan(first_))
        if (c.room > 0) cap = std::min(cap, part * c.room);
    const auto gains = std::span(gains_).subspan(first_ - 1);
    const double rounding = kRounding * energy_scale();
    const int window = wire.segments() - first_ + 1;
    int rejected = 0;
    for (int pass = 0; pass < kTrustPasses; ++pass) {
        model_contacts(contacts, rejected < kForeseenPasses);
        for (int correction = 0;; ++correction) {
            if ((pass > 0 || correction > 0) && report.updates > most_updates - window)
                return Trial::OutOfBudget;
            report.updates += window;
            model_axial_force(wire);
            riccati_backward(terms_.window(), mu_, least_pivot_, terms_.twist, gains);
            const double reach = roll_out(wire) / cap;
            if (!(reach <= 1)) {
                double factor = std::isfinite(reach) ? std::clamp(reach * reach, 2.0, 30.0) : 30.0;
                if (correction > 0) factor = 4;
                // Back to what the last step fitted with, which may just have been too hopeful.
                if (pass == 0 && mu_ > 0) factor = std::min(factor, 1 / kTrustGrowth);
                mu_ = std::max(mu_ * factor, 1e-6 * mu_unit_);
                break;
            }
            const bool last = correction == kCorrections - 1;
            const double energy = evaluate(wire, contacts), expected = std::min(0.0, slope_);
            const bool falls = energy <= energy_ + (last ? kArmijo : kGoodArmijo) * expected;
            // A fall too small to be seen is believed of the model of the accepted state alone: the wall as
            // it is at a trial state may have its rest where the wire is now, and then nothing would ever
            // move.
            const bool unseen = correction == 0 && -expected < rounding && energy < energy_ + rounding;
            if (std::isfinite(energy) && (falls || unseen)) {
                double turn = 0;
                for (int j = first_; j <= wire.segments(); ++j)
                    turn = std::max(turn, turns_[j].squaredNorm());
                report.largest_turn = std::max(report.largest_turn, std::sqrt(turn));
                foresee_forces(wire);
                accept(wire, contacts, energy);
                mu_ *= std::clamp(reach * reach, kTrustGrowth, 1.0);  // so that the next step just fits
                if (mu_ < kForgetTrust * mu_unit_) mu_ = 0;
                return Trial::Accepted;
            }
            ++report.rejected;
            if (last) {
                ++rejected;
                mu_ = std::max(4 * mu_, 1e-4 * mu_unit_);
                break;
            }
            model_trial_contacts(wire, contacts);
        }
    }
    return Trial::NothingLower;
}

/// At rest but not at a minimum: turn the worst segment a little down the negative curvature, the rest of the
/// wire answering as the recursion tells it to.
bool GlobalRelaxer::leave_saddle(Guidewire& wire, ContactSet& contacts, const RiccatiReport& pivots) {
    Vec2 way = pivots.way;
    if (way.x() < 0 || (way.x() == 0 && way.y() < 0)) way = -way;
    for (RiccatiGain& gain : gains_) gain.step.setZero();
    for (double kick = kKick; kick > 1e-7; kick *= 0.25) {
        for (const double sign : {1.0, -1.0}) {
            gains_[pivots.stage].step = sign * kick * way;
            roll_out(wire);
            const double energy = evaluate(wire, contacts);
            if (!std::isfinite(energy) || energy >= energy_) continue;
            accept(wire, contacts, energy);
            return true;
        }
    }
    return false;
}

/// The trust region's unit is the wire's stiffness over the width of the lumen, whatever the segments'
/// length.
void GlobalRelaxer::set_units(const Guidewire& wire, const ContactSet& contacts) {
    double stiffest = 0, room = kFree;
    for (int j = 0; j < wire.segments(); ++j) stiffest = std::max(stiffest, wire.spring_constant(j));
    for (const WallContact& c : contacts.contacts())
        if (c.room > 0) room = std::min(room, c.room);
    const double length = wire.inserted_length() / wire.segments();
    mu_unit_ = stiffest * length / std::pow(room < kFree ? room : length, 4);
    least_pivot_ = kLeastPivot * stiffest;
}

/// Stages of the segments up to `valid` are still those of the wire; the first window has that many segments.
GlobalRelaxer::Outcome GlobalRelaxer::descend(Guidewire& wire, ContactSet& contacts, int most_updates,
                                              int valid, int first_window, RelaxReport& report,
                                              const UpdateObserver& observer) {
    const int n = wire.segments();
    set_units(wire, contacts);
    mu_ = 0;
    gains_.resize(n);
    turns_.resize(n + 1);
    trial_joints_.resize(n + 1);
    trial_tangents_.resize(n + 1);
    settle_forces(wire, contacts);
    first_ = std::min(valid + 1, n);
    linearise(wire, contacts);
    bool proximal_known = true;  // of the accepted state
    double best = std::numeric_limits<double>::max(), looked_at = 0;
    int idle = 0;
    const int steps_before = report.newton_steps;
    auto open = [&](int segments) {
        open_window(wire, contacts, segments);
        proximal_known = true;
        best = std::numeric_limits<double>::max();
        idle = 0;
        looked_at = terms_.relative_gradient;
    };
    if (std::max(terms_.relative_gradient, terms_.proximal_gradient) > config_.tolerance) open(first_window);
    for (;;) {
        const int window = n - first_ + 1;
        const bool settled =
            terms_.relative_gradient <= std::max(config_.tolerance, kSettled * terms_.proximal_gradient);
        if (!proximal_known && (settled || terms_.relative_gradient < kFallen * looked_at)) {
            sum_from_tip(wire, terms_);
            proximal_known = true;
            looked_at = terms_.relative_gradient;
            continue;
        }
        report.gradient = std::max(terms_.relative_gradient, terms_.proximal_gradient);
        const bool affordable =
            report.newton_steps == steps_before || report.updates + window <= most_updates;
        if (proximal_known && report.gradient <= config_.tolerance) {
            if (const int moved = contacts.rejoin_vessels(wire); moved > 0) {
                open(n - moved + 1 + kMargin);
                continue;
            }
            if (terms_.twist && first_ > 1) open(n);  // the certificate is of the whole wire
            report.updates += n;
            const RiccatiReport pivots =
                riccati_backward(terms_.stages, 0, least_pivot_, terms_.twist, gains_);
            report.strict_minimum = pivots.shifted == 0;
            if (report.strict_minimum) return Outcome::Converged;
            if (!affordable) return Outcome::OutOfBudget;
            open(n);
            if (!leave_saddle(wire, contacts, pivots)) return Outcome::Converged;
        } else if (settled) {
            open(kWidening * window);
            continue;
        } else {
            if (!affordable) {
                if (!proximal_known) sum_from_tip(wire, terms_);
                report.gradient = std::max(terms_.relative_gradient, terms_.proximal_gradient);
                return Outcome::OutOfBudget;
            }
            const double before = energy_, least_fall = kProgress * energy_scale();
            // The first step is seen to its end, or a small budget would never get anywhere.
            const bool first_step = report.newton_steps == steps_before;
            const Trial trial =
                step(wire, contacts, first_step ? std::numeric_limits<int>::max() : most_updates, report);
            bool stuck = trial == Trial::NothingLower;
            if (trial != Trial::Accepted) {
                linearise(wire, contacts);
                proximal_known = true;
                if (trial == Trial::OutOfBudget) return Outcome::OutOfBudget;
            } else if (terms_.relative_gradient < 0.5 * best) {
                best = terms_.relative_gradient;
                idle = 0;
            } else if (energy_ > before - least_fall) {
                stuck = ++idle > (smooth_ ? kIdleSteps : kIdleStepsOnPlanes);
            }
            if (stuck && first_ == 1) return Outcome::Stuck;
            if (stuck) {
                open(n);
                continue;
            }
        }
        ++report.newton_steps;
        report.window = std::max(report.window, n - first_ + 1);
        if (observer) observer(first_, wire);
        linearise(wire, contacts, false);
        proximal_known = first_ == 1;
    }
}

/// A stiff wall lets only tiny steps through: find the way with a softer one, then harden it. What comes of
/// it counts only where it is lower than what there was: a soft wall also lets the wire out of the vessel.
GlobalRelaxer::Outcome GlobalRelaxer::descend_in_softer_walls(Guidewire& wire, const LumenWall& wall,
                                                              int updates, RelaxReport& report,
                                                              const UpdateObserver& observer) {
    const Guidewire before = wire;
    open_window(wire, *contacts_, wire.segments());
    const double energy_before = energy_;
    double stiffness = 0, softest = std::numeric_limits<double>::max();
    for (const WallContact& c : contacts_->contacts()) stiffness = std::max(stiffness, c.stiffness);
    for (int j = 0; j < wire.segments(); ++j)
        softest = std::min(softest, wire.spring_constant(j) / std::pow(wire.lengths[j + 1], 2));
    // Each wall has the budget anew: a wire left in a soft one would be outside.
    for (double k = kSoft * softest; k < stiffness; k *= 10) {
        const SofterWall soft(wall, k / stiffness);
        ContactSet softened(soft);
        softened.reset(wire);
        descend(wire, softened, report.updates + updates, 0, wire.segments(), report, observer);
        report.wall_queries += softened.queries();
    }
    rebuild_joints(wire);
    contacts_->update(wire);
    Outcome outcome =
        descend(wire, *contacts_, report.updates + updates, 0, wire.segments(), report, observer);
    open_window(wire, *contacts_, wire.segments());
    if (!(energy_ < energy_before)) {
        wire = before;
        contacts_->update(wire);
        open_window(wire, *contacts_, wire.segments());
        report.gradient = terms_.relative_gradient;
        outcome = Outcome::Stuck;
    }
    return outcome;
}

/// Proximal segments whose stages are as the last call left them.
int GlobalRelaxer::unchanged_segments(const Guidewire& wire) const {
    const int n = wire.segments(), both = std::min(n, end_.segments());
    if (end_.joints.empty() || wire.joints[0] != end_.joints[0] || wire.tangents[0] != end_.tangents[0] ||
        wire.load != end_.load || wire.spec.end_cells != end_.spec.end_cells ||
        wire.spec.segment_length != end_.spec.segment_length)
        return 0;
    int same = 0;
    while (same < both && wire.tangents[same + 1] == end_.tangents[same + 1] &&
           wire.lengths[same + 1] == end_.lengths[same + 1] && wire.rigidity[same] == end_.rigidity[same] &&
           wire.rest_angle[same] == end_.rest_angle[same])
        ++same;
    if (wire.roll != end_.roll || wire.base_director != end_.base_director)
        same = std::min(same, n - wire.curved_segments());
    return same;
}

/// The wire's answer to the motion to first order. False where nothing is known of it: it is not at rest, or
/// not this relaxer's.
bool GlobalRelaxer::predict(Guidewire& wire, HubMotion& motion) {
    const int n = wire.segments();
    if (!end_report_.converged || n != end_.segments() || unchanged_segments(wire) < n ||
        static_cast<int>(terms_.stages.size()) != n || contacts_->contacts().size() != wire.joints.size())
        return false;
    double cap = kFree;
    for (const WallContact& c : contacts_->contacts())
        if (c.room > 0) cap = std::min(cap, kPredictedCap * c.room);
    first_ = std::max(1, n - std::max(kPredictedWindow, 2 * wire.curved_segments()) + 1);
    if (terms_.twist) first_ = 1;  // the hub's turn comes from the base
    terms_.first = first_;
    measure_window(wire, *contacts_);
    const double energy = energy_, force = std::abs(end_report_.push_force);
    for (double part = 1; part > kLeastPredicted; part *= 0.5) {
        const FeedPlan plan = plan_feed(wire, part * motion.feed);
        if (motion.feed != 0 && !plan.whole) return false;
        FedStage fed[2];
        if (plan.change != 0) fed[0] = {plan.grows - first_, plan.change * wire.tangents[plan.grows]};
        if (plan.change_before != 0)
            fed[1] = {plan.grows - 1 - first_, plan.change_before * wire.tangents[plan.grows - 1]};
        if (plan.grows - 1 < first_) return false;
        riccati_backward(terms_.window(), 0, least_pivot_, terms_.twist,
                         std::span(gains_).subspan(first_ - 1), fed);
        for (FedStage& f : fed) f.stage += first_ - 1;
        if (!(roll_out(wire, part * motion.turn, fed) <= cap)) continue;
        const double rise = evaluate(wire, *contacts_) - energy;
        if (!(rise <= kPredictedRise * std::abs(energy) + kPredictedWork * force * std::abs(plan.mm)))
            continue;
        std::copy(trial_tangents_.begin() + first_, trial_tangents_.end(), wire.tangents.begin() + first_);
        std::copy(trial_joints_.begin() + first_, trial_joints_.end(), wire.joints.begin() + first_);
        if (motion.feed != 0) apply_feed(wire, plan);
        rotate(wire, part * motion.turn);
        predicted_ = 2 * (n - plan.grows + 2);
        motion = {plan.mm, part * motion.turn};
        return true;
    }
    // A wire about to snap answers by more than that to any motion: the smallest part, as it slides on.
    motion = {motion.feed == 0 ? 0 : feed(wire, kLeastPredicted * motion.feed),
              kLeastPredicted * motion.turn};
    rotate(wire, motion.turn);
    return true;
}

RelaxReport GlobalRelaxer::move(Guidewire& wire, const LumenWall& wall, HubMotion& motion,
                                const RelaxBudget& budget) {
    motion.feed = std::clamp(motion.feed, -wire.spec.segment_length, wire.spec.segment_length);
    if (wall_ != &wall || !predict(wire, motion)) {
        if (motion.feed != 0) motion.feed = feed(wire, motion.feed);
        rotate(wire, motion.turn);
    }
    return relax(wire, wall, budget);
}

RelaxReport GlobalRelaxer::relax(Guidewire& wire, const LumenWall& wall, const RelaxBudget& budget,
                                 const UpdateObserver& observer) {
    const int n = wire.segments();
    rebuild_joints(wire);
    if (wall_ != &wall) {
        wall_ = &wall;
        smooth_ = wall.smooth();
        contacts_.emplace(wall);
        end_ = {};
        end_report_ = {};
    }
    const int unchanged = unchanged_segments(wire);
    RelaxReport report;
    if (unchanged == n && n == end_.segments() && end_report_.converged && wire.stations == end_.stations) {
        report = end_report_;
        report.updates = report.newton_steps = report.window = report.rejected = 0;
        report.out_of_budget = false;
        report.wall_queries = 0;
        report.largest_turn = 0;
        return report;
    }
    if (wire.curved_segments() > 0) {
        const bool turned = end_.joints.empty() || wire.roll != end_.roll ||
                            wire.base_director != end_.base_director || directors_.empty();
        directors_.resize(wire.joints.size());
        directors_[0] = rolled_director(wire);
        transport_directors(wire, turned ? 1 : std::max(1, unchanged), directors_);
    }
    const long long asked_before = contacts_->queries();
    contacts_->update(wire);
    const int moved = contacts_->rejoin_vessels(wire);
    // The last segment that is unchanged ends at a joint whose share of the wall may have changed.
    int valid = wire.load.isZero(0) ? std::max(0, unchanged - 1) : 0;
    if (moved > 0) valid = std::min(valid, moved - 1);
    const int most_updates = std::max(0, budget.updates);
    const int unsettled = end_report_.converged ? 0 : end_report_.window;
    const int changed = std::max(kLeastWindow, predicted_ > 0 ? predicted_ : kChangedShare * (n - unchanged));
    predicted_ = 0;
    Outcome outcome =
        descend(wire, *contacts_, most_updates, valid, std::max(changed, unsettled), report, observer);
    if (outcome == Outcome::Stuck && smooth_)
        outcome = descend_in_softer_walls(wire, wall, most_updates, report, observer);
    rebuild_joints(wire);
    for (int i = 1; i <= n; ++i) wire.stations[i] = contacts_->contacts()[i].station;

    report.converged = outcome == Outcome::Converged && report.strict_minimum;
    report.out_of_budget = outcome == Outcome::OutOfBudget;
    report.at_rest = outcome == Outcome::Converged;
    report.contacts = contacts_->touching();
    report.wall_queries += contacts_->queries() - asked_before;
    report.push_force = terms_.push.dot(wire.tangents[0]);
    report.base_torque = terms_.torque;
    double least = 1;
    for (int j = 0; j < n; ++j) least = std::min(least, straightness(wire, directors_, j));
    report.largest_bend = std::acos(std::max(-1.0, least));
    end_ = wire;
    end_report_ = report;
    return report;
}

}  // namespace physics
