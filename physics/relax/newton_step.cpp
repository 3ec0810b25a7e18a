#include "physics/relax/newton_step.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace physics {
namespace {

/// What places of joints are rounded relative to [mm].
double farthest(const Chain& wire) {
    assert(!wire.joints.empty());
    return wire.joints.back().cwiseAbs().maxCoeff() + wire.joints.front().cwiseAbs().maxCoeff();
}

/// Whether a joint from `first` on turns so far that the cosine is below this one.
bool kinked(const Chain& wire, int first, double cosine) {
    assert(first >= 0);
    for (int j = first; j < wire.segments(); ++j)
        if (wire.tangents[j].dot(wire.tangents[j + 1]) < cosine) return true;
    return false;
}

}  // namespace

NewtonStep::NewtonStep(Iterate& at, Chain& wire, ContactSet& contacts, const GlobalOptions& options,
                       bool smooth_wall, int most_updates, RelaxReport& report)
    : at_(at),
      wire_(wire),
      contacts_(contacts),
      options_(options),
      smooth_(smooth_wall),
      most_updates_(most_updates),
      report_(report),
      first_(at.model.first()),
      window_(at.window(wire)),
      cap_(largest_move()),
      rounding_(energy_rounding()),
      rounded_(std::numeric_limits<double>::epsilon() * farthest(wire)) {
    assert(contacts.contacts().size() == wire.joints.size());
    assert(first_ >= 1 && window_ >= 1);
}

/// Δ: a fraction of the narrowest lumen of the window, or of the way that a vessel has made for a joint.
double NewtonStep::largest_move() const {
    const TrustOptions& o = options_.trust;
    const double fraction = kinked(wire_, first_ - 1, o.kinked_cosine) ? o.kinked_fraction : o.step_fraction;
    double cap = o.unbounded;
    for (const WallContact& c : contacts_.contacts().subspan(first_))
        if (c.clearance > 0) cap = std::min(cap, fraction * std::max(c.clearance, c.given.norm()));
    assert(cap > 0);
    return cap;
}

/// What the energy is rounded by: a fraction of itself, and what the wall's is because joints' places are.
/// The latter is far more where a hard wall bears much force with little energy [N·mm].
double NewtonStep::energy_rounding() const {
    const StepOptions& o = options_.step;
    double force = 0;
    for (const WallContact& c : contacts_.contacts().subspan(first_))
        if (c.touches()) force += c.force();
    const double of_places =
        o.rounded_places * std::numeric_limits<double>::epsilon() * farthest(wire_) * force;
    return o.rounding_fraction * at_.energy_scale() + of_places;
}

NewtonStep::Result NewtonStep::take() {
    at_.trust.begin_step();
    Trial trial;
    for (; trial.region < options_.trust.most_trials && at_.trust.moves_joints(); ++trial.region) {
        if (trial.region > 0)
            at_.model.take_contacts(wire_, contacts_, first_, rejected_ < options_.step.trials_predicted);
        Next next = Next::CorrectedWall;
        for (trial.correction = 0; next == Next::CorrectedWall; ++trial.correction) {
            assert(trial.correction < options_.step.corrections);
            next = attempt(trial);
        }
        if (next == Next::Accepted) return Result::Accepted;
        if (next == Next::OutOfBudget) return Result::OutOfBudget;
        if (next == Next::NothingLower) return Result::NothingLower;
    }
    return Result::NothingLower;
}

NewtonStep::Next NewtonStep::attempt(const Trial& trial) {
    if (!trial.is_first() && report_.updates > most_updates_ - window_) return Next::OutOfBudget;
    assert(window_ == at_.window(wire_) && trial.correction < options_.step.corrections);
    report_.updates += window_;
    if (!trial.is_first()) at_.model.solve(wire_, at_.trust.mu());  // else it is, as it was linearised
    const double reach = at_.model.roll_out(wire_) / cap_;
    if (trial.region > 0 && reach * cap_ < rounded_) return Next::NothingLower;
    if (!fits(trial, reach)) return Next::OtherRegion;
    if (!lowers_energy(trial)) return reject(trial);
    accept(reach);
    return Next::Accepted;
}

/// Whether the trial is within the cap, and not too short to lead anywhere; else μ is another one.
bool NewtonStep::fits(const Trial& trial, double reach) {
    assert(!(reach < 0));
    if (!(reach <= 1)) {
        if (!std::isfinite(reach)) ++report_.rejected;
        at_.trust.too_far(reach, trial.region == 0, trial.correction > 0);
        return false;
    }
    const bool bisects = at_.idle >= options_.step.idle_before_bisection;
    return !(bisects && trial.correction == 0 && rejected_ == 0 && at_.trust.too_short(reach));
}

bool NewtonStep::lowers_energy(const Trial& trial) {
    const StepOptions& o = options_.step;
    const bool corrected = trial.correction > 0, last = trial.correction == o.corrections - 1;
    double energy = at_.model.evaluate(wire_, contacts_);
    const double expected = std::min(0.0, at_.model.slope());
    if (!corrected) uncorrected_ = expected;
    const double asked = std::min((last ? o.armijo : o.good_armijo) * expected,
                                  corrected ? o.corrected_fraction * uncorrected_ : 0.0);
    assert(asked <= 0);
    bool falls = energy <= at_.energy + asked;
    if (!falls && std::isfinite(energy)) {
        const KeptFields held = contacts_.hold();
        energy += held.energy;
        falls = energy <= at_.energy + held.jump + asked;
    }
    trial_energy_ = energy;
    // A fall too small to be seen is believed only of the model of the accepted state: the wall at a trial
    // state may have its rest where the wire is now, and then nothing would ever move.
    const bool unseen = !corrected && -expected < rounding_ && energy < at_.energy + rounding_;
    return std::isfinite(energy) && (falls || unseen);
}

void NewtonStep::accept(double reach) {
    const StepOptions& o = options_.step;
    assert(std::isfinite(trial_energy_) && reach >= 0 && reach <= 1);
    report_.largest_turn = std::max(report_.largest_turn, at_.model.largest_turn());
    at_.idle += reach > o.sliding ? 1 : o.hardly_moved;
    at_.model.predict_contact_forces(wire_);
    at_.accept(wire_, contacts_, trial_energy_);
    const bool crawls =
        at_.idle >= o.idle_before_bisection && at_.pivots.shifted > 0 && reach < options_.trust.short_step;
    if (crawls)
        at_.trust.crawled();
    else
        at_.trust.accepted(reach, rejected_ > 0);
}

/// A trial that does not lower the energy: the wall is corrected, or, as often as that is allowed, μ raised.
NewtonStep::Next NewtonStep::reject(const Trial& trial) {
    ++report_.rejected;
    if (trial.correction < options_.step.corrections - 1) {
        at_.model.take_trial_contacts(wire_, contacts_);
        return Next::CorrectedWall;
    }
    if (++rejected_ == options_.step.most_rejections_on_planes && !smooth_) return Next::NothingLower;
    at_.trust.rejected();
    assert(rejected_ > 0);
    return Next::OtherRegion;
}

}  // namespace physics
