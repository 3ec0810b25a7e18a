#include "physics/global_relaxer.h"

#include <algorithm>
#include <cmath>

#include "physics/bending.h"

namespace physics {
namespace {

constexpr double kCap = 0.3;       // largest joint move of a step, in lumen radii
constexpr double kFree = 1e9;      // room of a joint that knows no lumen [mm]
constexpr int kContactPasses = 3;  // backward passes for one set of contacts' geometry
constexpr int kTrustPasses = 40;   // changes of μ for one step
constexpr int kHalvings = 4;       // of a step before μ is raised
constexpr double kArmijo = 1e-4;
constexpr double kTrustGrowth = 0.1;   // of μ after a step well inside its cap
constexpr double kForgetTrust = 1e-8;  // μ below this share of its unit is none
constexpr double kRounding = 1e-13;    // of the energy: less than this a line search can't see
constexpr double kProgress = 1e-4;  // of the energy: a step that falls by less is idle, if the gradient stays
constexpr int kIdleSteps = 40;      // of them before the wall is made softer
constexpr double kSoft = 1.0;       // k λ²/C that always converges; continuation starts there
constexpr double kKick = 1e-3;      // turn that leaves a saddle [rad]

/// A wall made softer, for the continuation in stiffness.
class SofterWall final : public LumenWall {
public:
    SofterWall(const LumenWall& wall, double share) : wall_(wall), share_(share) {}
    void contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        wall_.contacts(joints, contacts);
        for (WallContact& c : contacts) c.stiffness *= share_;
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

}  // namespace

/// Terms of the accepted state, and which joints the model takes for touching.
void GlobalRelaxer::load(const Guidewire& wire, const ContactSet& contacts) {
    const int n = wire.segments();
    if (wire.curved_segments() > 0) {
        directors_.resize(n + 1);
        directors_[0] = rolled_director(wire);
        transport_directors(wire, 1, directors_);
    }
    assemble(wire, contacts.contacts(), directors_, 1, terms_);
    gains_.resize(terms_.stages.size());
    active_.resize(n + 1);
    for (int j = 1; j <= n; ++j) active_[j] = contacts.contacts()[j].touches();
}

/// The contacts that the last rollout would have: true where that changes the model.
bool GlobalRelaxer::predict_contacts(const ContactSet& contacts) {
    bool changed = false;
    for (int j = 1; j < static_cast<int>(active_.size()); ++j) {
        const WallContact& c = contacts.contacts()[j];
        const double gap = contacts.predicted_penetration(j, trial_joints_[j]);
        const bool active = gap > 0 && c.normal.squaredNorm() > 0.25;
        if (active == (active_[j] != 0)) continue;
        changed = true;
        set_contact(c, j, active);
    }
    return changed;
}

void GlobalRelaxer::set_contact(const WallContact& c, int joint, bool active) {
    active_[joint] = active;
    RiccatiStage& s = terms_.stages[joint - 1];
    s.touches = active;
    if (!active) return;
    s.force = c.stiffness * c.penetration * c.normal;
    s.stiffness = c.stiffness * c.normal * c.normal.transpose();
    if (c.touches()) s.stiffness += c.force() * c.curvature;
}

void GlobalRelaxer::restore_contacts(const ContactSet& contacts) {
    for (int j = 1; j < static_cast<int>(active_.size()); ++j) {
        const WallContact& c = contacts.contacts()[j];
        if ((active_[j] != 0) != c.touches()) set_contact(c, j, c.touches());
    }
}

/// Trial state: gains applied from the base. Returns the largest move of a joint [mm].
double GlobalRelaxer::roll_out(const Guidewire& wire, double share) {
    const int n = wire.segments();
    trial_joints_.resize(n + 1);
    trial_tangents_.resize(n + 1);
    turns_.resize(n + 1);
    trial_joints_[0] = wire.joints[0];
    trial_tangents_[0] = wire.tangents[0];
    turns_[0].setZero();
    double twist = 0, farthest = 0;
    slope_ = 0;
    for (int j = 1; j <= n; ++j) {
        const RiccatiStage& s = terms_.stages[j - 1];
        const RiccatiGain& gain = gains_[j - 1];
        Vec2 alpha = share * gain.step;
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

/// Energy of the trial state; its contacts wait in the set.
double GlobalRelaxer::evaluate(Guidewire& wire, ContactSet& contacts) {
    double energy = contacts.evaluate(trial_joints_, 1);
    std::swap(wire.tangents, trial_tangents_);
    if (terms_.twist) transport_directors(wire, 1, directors_);
    for (int j = 0; j < wire.segments(); ++j) energy += joint_energy(wire, directors_, j);
    std::swap(wire.tangents, trial_tangents_);
    return energy;
}

void GlobalRelaxer::accept(Guidewire& wire, ContactSet& contacts, double energy) {
    std::swap(wire.tangents, trial_tangents_);
    std::swap(wire.joints, trial_joints_);
    contacts.commit();
    energy_ = energy;
}

/// One Newton step. False where nothing lower was found.
bool GlobalRelaxer::step(Guidewire& wire, ContactSet& contacts, RelaxReport& report) {
    double cap = kFree;
    for (const WallContact& c : contacts.contacts())
        if (c.room > 0) cap = std::min(cap, kCap * c.room);
    const double least_pivot = 1e-6 * mu_unit_;
    int contact_passes = 0;
    for (int pass = 0; pass < kTrustPasses; ++pass) {
        riccati_backward(terms_.stages, mu_, least_pivot, terms_.twist, gains_);
        const double reach = roll_out(wire, 1.0) / cap;
        const bool foreseen = contact_passes > 0 && contact_passes < kContactPasses;
        if (!(reach <= 1) && foreseen) {
            restore_contacts(contacts);  // the foreseen contacts let the wire fly: on with the true ones
            contact_passes = kContactPasses;
            continue;
        }
        if (!(reach <= 1)) {
            const double factor = std::isfinite(reach) ? std::clamp(reach * reach, 2.0, 30.0) : 30.0;
            mu_ = std::max(mu_ * factor, 1e-6 * mu_unit_);
            continue;
        }
        if (contact_passes < kContactPasses - 1 && predict_contacts(contacts)) {
            ++contact_passes;
            continue;
        }
        double share = 1;
        for (int halving = 0; halving <= kHalvings; ++halving, share *= 0.5) {
            if (halving > 0) roll_out(wire, share);
            const double energy = evaluate(wire, contacts);
            const double expected = std::min(0.0, slope_);
            const bool unseen = -expected < kRounding * energy_ && energy < energy_ * (1 + kRounding);
            if (!std::isfinite(energy) || !(energy <= energy_ + kArmijo * expected || unseen)) {
                ++report.rejected;
                continue;
            }
            double turn = 0;
            for (const Vec2& alpha : turns_) turn = std::max(turn, alpha.squaredNorm());
            report.largest_turn = std::max(report.largest_turn, std::sqrt(turn));
            accept(wire, contacts, energy);
            mu_ *= std::clamp(reach * reach, kTrustGrowth, 1.0);  // so that the next step just fits
            if (mu_ < kForgetTrust * mu_unit_) mu_ = 0;
            return true;
        }
        if (contact_passes > 0 && contact_passes < kContactPasses) {
            restore_contacts(contacts);
            contact_passes = kContactPasses;
        } else {
            mu_ = std::max(4 * mu_, 1e-4 * mu_unit_);
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
        roll_out(wire, 1.0);
        const double energy = evaluate(wire, contacts);
        if (!std::isfinite(energy) || energy >= energy_) continue;
        accept(wire, contacts, energy);
        return true;
    }
    return false;
}

GlobalRelaxer::Outcome GlobalRelaxer::descend(Guidewire& wire, ContactSet& contacts, int most_steps,
                                              RelaxReport& report, const UpdateObserver& observer) {
    const int n = wire.segments();
    double stiffest = 0;
    for (int j = 0; j < n; ++j) stiffest = std::max(stiffest, wire.spring_constant(j));
    mu_unit_ = stiffest / std::pow(wire.inserted_length() / n, 3);
    mu_ = 0;
    double best = std::numeric_limits<double>::max();
    int idle = 0;
    load(wire, contacts);
    energy_ = contacts.energy(1) + bending_energy(wire);
    for (;;) {
        report.gradient = terms_.relative_gradient;
        if (terms_.relative_gradient <= config_.tolerance) {
            const RiccatiReport pivots =
                riccati_backward(terms_.stages, 0, 1e-6 * mu_unit_, terms_.twist, gains_);
            report.strict_minimum = pivots.shifted == 0;
            if (report.strict_minimum) return Outcome::Converged;
            if (report.newton_steps >= most_steps) return Outcome::OutOfBudget;
            if (!leave_saddle(wire, contacts, pivots)) return Outcome::Converged;
        } else {
            if (report.newton_steps >= most_steps) return Outcome::OutOfBudget;
            const double before = energy_;
            if (!step(wire, contacts, report)) return Outcome::Stuck;
            if (terms_.relative_gradient < 0.5 * best) {
                best = terms_.relative_gradient;
                idle = 0;
            } else if (energy_ > before * (1 - kProgress) && ++idle > kIdleSteps) {
                return Outcome::Stuck;
            }
        }
        ++report.newton_steps;
        if (observer) observer(1, wire);
        load(wire, contacts);
    }
}

RelaxReport GlobalRelaxer::relax(Guidewire& wire, const LumenWall& wall, const RelaxBudget& budget,
                                 const UpdateObserver& observer) {
    RelaxReport report;
    const int n = wire.segments();
    const int most_steps = std::max(1, budget.updates / n);
    rebuild_joints(wire);
    ContactSet contacts(wall);
    contacts.reset(wire);
    Outcome outcome = descend(wire, contacts, most_steps, report, observer);
    if (outcome == Outcome::Stuck) {
        // A stiff wall lets only tiny steps through: find the way with a softer one, then harden it.
        double stiffness = 0, softest = std::numeric_limits<double>::max();
        for (const WallContact& c : contacts.contacts()) stiffness = std::max(stiffness, c.stiffness);
        for (int j = 0; j < n; ++j)
            softest = std::min(softest, wire.spring_constant(j) / std::pow(wire.lengths[j + 1], 2));
        for (double k = kSoft * softest; k < stiffness; k *= 10) {
            const SofterWall soft(wall, k / stiffness);
            ContactSet softened(soft);
            softened.reset(wire);
            descend(wire, softened, most_steps, report, observer);
        }
        rebuild_joints(wire);
        contacts.reset(wire);
        outcome = descend(wire, contacts, most_steps, report, observer);
    }
    rebuild_joints(wire);
    for (int i = 1; i <= n; ++i) wire.stations[i] = contacts.contacts()[i].station;

    report.converged = outcome == Outcome::Converged && report.strict_minimum;
    report.updates = report.newton_steps * n;
    report.contacts = contacts.touching();
    report.wall_queries = contacts.queries();
    report.push_force = terms_.push.dot(wire.tangents[0]);
    report.base_torque = terms_.torque;
    for (int j = 0; j < n; ++j)
        report.largest_bend = std::max(report.largest_bend, bend(wire, directors_, j));
    return report;
}

}  // namespace physics
