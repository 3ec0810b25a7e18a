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
constexpr double kSoft = 1.0;       // k λ²/C that always converges; continuation starts there
constexpr double kLeastPivot = 1e-6;  // of a recursion, over C
constexpr double kKick = 1e-3;        // turn that leaves a saddle [rad]
constexpr double kSettled = 0.01;     // |dU/du| in a window over that proximal of it: time to widen
constexpr int kWidening = 4;          // of a window
constexpr int kLeastWindow = 64;      // segments

/// A wall made softer, for the continuation in stiffness.
class SofterWall final : public LumenWall {
public:
    SofterWall(const LumenWall& wall, double share) : wall_(wall), share_(share) {}
    void contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        wall_.contacts(joints, contacts);
        for (WallContact& c : contacts) c.share_stiffness(share_);
    }

private:
    const LumenWall& wall_;
    double share_;
};

/// Angle of a joint away from its rest shape [rad].
double bend(const Guidewire& wire, const std::vector<Vec3>& d, int joint) {
    const Vec3 rest =
        wire.rest_angle[joint] == 0 ? wire.tangents[joint] : rest_direction(wire, joint, d[joint]);
    return std::atan2(rest.cross(wire.tangents[joint + 1]).norm(), rest.dot(wire.tangents[joint + 1]));
}

/// Whether a joint turns by more than 60°.
bool kinked(const Guidewire& wire) {
    for (int j = 0; j < wire.segments(); ++j)
        if (wire.tangents[j].dot(wire.tangents[j + 1]) < 0.5) return true;
    return false;
}

}  // namespace

/// Terms of the accepted state.
void GlobalRelaxer::linearise(const Guidewire& wire, const ContactSet& contacts) {
    if (wire.curved_segments() > 0) {
        directors_.resize(wire.joints.size());
        directors_[0] = rolled_director(wire);
        transport_directors(wire, first_, directors_);
    }
    assemble(wire, contacts.contacts(), directors_, first_, terms_);
}

void GlobalRelaxer::open_window(const Guidewire& wire, const ContactSet& contacts, int segments) {
    const int n = wire.segments();
    first_ = std::max(1, n - segments + 1);
    linearise(wire, contacts);
    energy_ = contacts.energy(wire.joints, first_);
    for (int j = first_ - 1; j < n; ++j) energy_ += joint_energy(wire, directors_, j);
    load_scale_ = contacts.load_scale(first_);
}

/// Forces to start from. No segment at rest passes on more than C/λ, under which a joint would buckle by
/// itself: a larger force is that of a joint which has just been put into a stiff wall.
void GlobalRelaxer::settle_forces(const Guidewire& wire, const ContactSet& contacts) {
    for (int j = 1; j <= wire.segments(); ++j)
        planes_[j].force =
            std::min(contacts.contacts()[j].force(), wire.spring_constant(j - 1) / wire.lengths[j]);
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

/// Trial state: gains applied from the window's base. Returns the largest move of a joint [mm].
double GlobalRelaxer::roll_out(const Guidewire& wire) {
    const int n = wire.segments();
    trial_joints_[first_ - 1] = wire.joints[first_ - 1];
    trial_tangents_[first_ - 1] = wire.tangents[first_ - 1];
    turns_[first_ - 1].setZero();
    double twist = 0, farthest = 0;
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
        trial_joints_[j] = trial_joints_[j - 1] + s.length * trial_tangents_[j];
        farthest = std::max(farthest, (trial_joints_[j] - wire.joints[j]).squaredNorm());
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

/// One Newton step. False where nothing lower was found.
bool GlobalRelaxer::step(Guidewire& wire, ContactSet& contacts, RelaxReport& report) {
    const double part = kinked(wire) ? kKinkedCap : kCap;
    double cap = kFree;
    for (const WallContact& c : contacts.contacts().subspan(first_))
        if (c.room > 0) cap = std::min(cap, part * c.room);
    const auto gains = std::span(gains_).subspan(first_ - 1);
    const double rounding = kRounding * energy_scale();
    int rejected = 0;
    for (int pass = 0; pass < kTrustPasses; ++pass) {
        model_contacts(contacts, rejected < kForeseenPasses);
        for (int correction = 0;; ++correction) {
            model_axial_force(wire);
            riccati_backward(terms_.window(), mu_, least_pivot_, terms_.twist, gains);
            const double reach = roll_out(wire) / cap;
            if (!(reach <= 1)) {
                double factor = std::isfinite(reach) ? std::clamp(reach * reach, 2.0, 30.0) : 30.0;
                if (correction > 0) factor = 4;
                mu_ = std::max(mu_ * factor, 1e-6 * mu_unit_);
                break;
            }
            const bool last = correction == kCorrections - 1;
            const double energy = evaluate(wire, contacts), expected = std::min(0.0, slope_);
            const bool falls = energy <= energy_ + (last ? kArmijo : kGoodArmijo) * expected;
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
                return true;
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
    return false;
}

/// At rest but not at a minimum: turn the worst segment a little down the negative curvature, the rest of the
/// wire answering as the recursion tells it to.
bool GlobalRelaxer::leave_saddle(Guidewire& wire, ContactSet& contacts, const RiccatiReport& pivots) {
    Vec2 way = pivots.way;
    if (way.x() < 0 || (way.x() == 0 && way.y() < 0)) way = -way;
    for (RiccatiGain& gain : gains_) gain.step.setZero();
    for (double kick = kKick; kick > 1e-7; kick *= 0.25) {
        gains_[pivots.stage].step = kick * way;
        roll_out(wire);
        const double energy = evaluate(wire, contacts);
        if (!std::isfinite(energy) || energy >= energy_) continue;
        accept(wire, contacts, energy);
        return true;
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

GlobalRelaxer::Outcome GlobalRelaxer::descend(Guidewire& wire, ContactSet& contacts,
                                              const RelaxBudget& budget, int window, RelaxReport& report,
                                              const UpdateObserver& observer) {
    const int n = wire.segments();
    set_units(wire, contacts);
    mu_ = 0;
    gains_.resize(n);
    turns_.resize(n + 1);
    trial_joints_.resize(n + 1);
    trial_tangents_.resize(n + 1);
    planes_.assign(n + 1, {});
    settle_forces(wire, contacts);
    open_window(wire, contacts, n);
    if (terms_.relative_gradient > config_.tolerance && window < n) open_window(wire, contacts, window);
    double best = std::numeric_limits<double>::max();
    int idle = 0;
    const int most_updates = report.updates + budget.updates, steps_before = report.newton_steps;
    auto widen = [&](int segments) {
        open_window(wire, contacts, segments);
        best = std::numeric_limits<double>::max();
        idle = 0;
    };
    for (;;) {
        window = n - first_ + 1;
        report.gradient = std::max(terms_.relative_gradient, terms_.proximal_gradient);
        const bool affordable =
            report.newton_steps == steps_before || report.updates + window <= most_updates;
        if (report.gradient <= config_.tolerance) {
            if (first_ > 1) widen(n);  // the certificate is of the whole wire
            const RiccatiReport pivots =
                riccati_backward(terms_.stages, 0, least_pivot_, terms_.twist, gains_);
            report.strict_minimum = pivots.shifted == 0;
            if (report.strict_minimum) return Outcome::Converged;
            if (!affordable) return Outcome::OutOfBudget;
            if (!leave_saddle(wire, contacts, pivots)) return Outcome::Converged;
        } else if (terms_.relative_gradient <=
                   std::max(config_.tolerance, kSettled * terms_.proximal_gradient)) {
            widen(kWidening * window);
            continue;
        } else {
            if (!affordable) return Outcome::OutOfBudget;
            const double before = energy_, least_fall = kProgress * energy_scale();
            bool stuck = !step(wire, contacts, report);
            if (stuck) {
                linearise(wire, contacts);
            } else if (terms_.relative_gradient < 0.5 * best) {
                best = terms_.relative_gradient;
                idle = 0;
            } else if (energy_ > before - least_fall) {
                stuck = ++idle > kIdleSteps;
            }
            if (stuck && first_ == 1) return Outcome::Stuck;
            if (stuck) {
                widen(n);
                continue;
            }
        }
        ++report.newton_steps;
        report.updates += n - first_ + 1;
        report.window = std::max(report.window, n - first_ + 1);
        if (observer) observer(first_, wire);
        linearise(wire, contacts);
    }
}

/// Distal segments from the first one that is not as the last call left it.
int GlobalRelaxer::changed_segments(const Guidewire& wire) const {
    const int n = wire.segments(), both = std::min(n, end_.segments());
    if (end_.joints.empty() || wire.joints[0] != end_.joints[0] || wire.tangents[0] != end_.tangents[0] ||
        wire.load != end_.load)
        return n;
    int same = 0;
    while (same < both && wire.tangents[same + 1] == end_.tangents[same + 1] &&
           wire.lengths[same + 1] == end_.lengths[same + 1] && wire.rigidity[same] == end_.rigidity[same] &&
           wire.rest_angle[same] == end_.rest_angle[same])
        ++same;
    if (wire.roll != end_.roll || wire.base_director != end_.base_director)
        same = std::min(same, n - wire.curved_segments());
    if (n != end_.segments()) same = std::min(same, n - 1);
    return n - same;
}

RelaxReport GlobalRelaxer::relax(Guidewire& wire, const LumenWall& wall, const RelaxBudget& budget,
                                 const UpdateObserver& observer) {
    const int n = wire.segments();
    rebuild_joints(wire);
    if (wall_ != &wall) {
        wall_ = &wall;
        contacts_.emplace(wall);
        end_ = {};
        end_report_ = {};
    }
    const int changed = changed_segments(wire);
    RelaxReport report;
    if (changed == 0 && end_report_.converged && wire.stations == end_.stations) {
        report = end_report_;
        report.updates = report.newton_steps = report.window = report.rejected = 0;
        report.wall_queries = 0;
        report.largest_turn = 0;
        return report;
    }
    const long long asked_before = contacts_->queries();
    contacts_->update(wire);
    const int unsettled = end_report_.converged ? 0 : end_report_.window;
    const int window = std::max({kLeastWindow, 2 * changed, unsettled});
    Outcome outcome = descend(wire, *contacts_, budget, window, report, observer);
    if (outcome == Outcome::Stuck) {
        // A stiff wall lets only tiny steps through: find the way with a softer one, then harden it.
        double stiffness = 0, softest = std::numeric_limits<double>::max();
        for (const WallContact& c : contacts_->contacts()) stiffness = std::max(stiffness, c.stiffness);
        for (int j = 0; j < n; ++j)
            softest = std::min(softest, wire.spring_constant(j) / std::pow(wire.lengths[j + 1], 2));
        for (double k = kSoft * softest; k < stiffness; k *= 10) {
            const SofterWall soft(wall, k / stiffness);
            ContactSet softened(soft);
            softened.reset(wire);
            descend(wire, softened, budget, n, report, observer);
            report.wall_queries += softened.queries();
        }
        rebuild_joints(wire);
        contacts_->update(wire);
        outcome = descend(wire, *contacts_, budget, n, report, observer);
    }
    rebuild_joints(wire);
    for (int i = 1; i <= n; ++i) wire.stations[i] = contacts_->contacts()[i].station;

    report.converged = outcome == Outcome::Converged && report.strict_minimum;
    report.contacts = contacts_->touching();
    report.wall_queries += contacts_->queries() - asked_before;
    report.push_force = terms_.push.dot(wire.tangents[0]);
    report.base_torque = terms_.torque;
    for (int j = 0; j < n; ++j)
        report.largest_bend = std::max(report.largest_bend, bend(wire, directors_, j));
    end_ = wire;
    end_report_ = report;
    return report;
}

}  // namespace physics
