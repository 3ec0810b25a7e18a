#include "physics/relax/descent.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/relax/newton_step.h"

namespace physics {

Descent::Descent(Iterate& at, Chain& wire, ContactSet& contacts, const GlobalOptions& options,
                 bool smooth_wall, const DescentTask& task, RelaxReport& report,
                 const UpdateObserver& observer)
    : at_(at),
      wire_(wire),
      contacts_(contacts),
      options_(options),
      smooth_(smooth_wall),
      task_(task),
      report_(report),
      observer_(observer),
      segments_(wire.segments()),
      steps_before_(report.newton_steps) {
    assert(segments_ >= 1 && contacts.contacts().size() == wire.joints.size());
    assert(task.tolerance > 0 && task.valid >= 0 && task.first_window >= 1);
}

Termination Descent::run() {
    start();
    for (;;) {
        look_proximal();
        report_.gradient = gradient();
        assert(at_.model.stages() == segments_);
        const End end = at_rest() ? certify() : settled() ? widen() : take_step();
        if (end) return *end;
    }
}

/// Model of the wire as it comes, and the first window.
void Descent::start() {
    at_.set_units(wire_, contacts_, options_);
    const bool goes_on = std::exchange(at_.goes_on, false);
    if (goes_on)
        at_.foreseen = segments_;
    else
        at_.trust.reset(), at_.idle = 0;
    const int idle = at_.idle;
    const double best = at_.best_gradient;
    at_.model.start(wire_, contacts_, std::exchange(at_.foreseen, 0));
    at_.linearise(wire_, contacts_, std::min(task_.valid + 1, segments_));
    at_.model.sum_proximal(wire_, contacts_);
    at_.best_gradient = std::numeric_limits<double>::max();
    if (gradient() > task_.tolerance) {
        // A model of the whole wire stands already.
        if (at_.model.first() == 1 && task_.first_window >= segments_) {
            at_.measure_window(wire_, contacts_);
            begin_window();
        } else {
            open(task_.first_window);
        }
    }
    if (goes_on) at_.idle = idle, at_.best_gradient = best;
    assert(proximal_known_);
}

void Descent::begin_window() {
    assert(at_.model.stages() == segments_ && at_.model.first() <= segments_);
    proximal_known_ = true;
    looked_at_ = terms().relative_gradient;
    at_.best_gradient = std::numeric_limits<double>::max();
    at_.idle = 0;
}

void Descent::open(int segments) {
    assert(segments >= 1);
    at_.open_window(wire_, contacts_, segments);
    begin_window();
    assert(at_.model.first() >= 1 && at_.model.first() <= segments_);
}

double Descent::gradient() const {
    return std::max(terms().relative_gradient, terms().proximal_gradient);
}

void Descent::sum_proximal() {
    at_.model.sum_proximal(wire_, contacts_);
    proximal_known_ = true;
    assert(at_.model.stages() == segments_);
}

/// Sums the gradient proximal of the window anew where it is time to.
void Descent::look_proximal() {
    const double within = terms().relative_gradient;
    if (proximal_known_ || !(settled() || within < options_.window.settled_fraction * looked_at_)) return;
    sum_proximal();
    looked_at_ = within;
}

bool Descent::at_rest() const {
    assert(task_.tolerance > 0);
    return proximal_known_ && gradient() <= task_.tolerance;
}

/// Whether the window's gradient is small: against the tolerance, or against that proximal of it.
bool Descent::settled() const {
    assert(terms().first >= 1);
    return terms().relative_gradient <=
           std::max(task_.tolerance, options_.window.settled_fraction * terms().proximal_gradient);
}

Descent::End Descent::widen() {
    assert(proximal_known_ && at_.model.first() > 1);
    open(options_.window.widening * at_.window(wire_));
    return {};
}

/// At rest: the pivots of a pass over the whole wire at μ = 0 say whether at a strict minimum.
Descent::End Descent::certify() {
    assert(at_rest());
    if (!task_.certifies) return Termination::Stationary;
    if (const int moved = contacts_.rejoin_vessels(wire_); moved > 0) {
        open(segments_ - moved + 1 + options_.window.margin);
        return {};
    }
    const bool goes_on = affordable(at_.window(wire_));
    // With twist a stage depends on the torque from all that is distal of it.
    if (terms().frames.count > 0 && at_.model.first() > 1) open(segments_);
    if (!affordable(segments_)) return Termination::OutOfBudget;
    report_.updates += segments_;
    if (!at_.model.certifies()) at_.pivots = at_.model.certify(wire_, contacts_);
    if (at_.pivots.shifted == 0) return Termination::StrictMinimum;
    assert(at_.pivots.shifted > 0 && at_.pivots.stage < segments_);
    if (!goes_on) return Termination::OutOfBudget;
    at_.trust.reset();
    open(segments_);
    at_.pivots = at_.model.certify(wire_, contacts_);
    if (at_.pivots.shifted == 0 || !leave_saddle()) return Termination::Stationary;
    advance();
    return {};
}

Descent::End Descent::take_step() {
    const int window = at_.window(wire_);
    assert(window >= 1 && window <= segments_);
    if (!affordable(window)) {
        if (!proximal_known_) sum_proximal();
        report_.gradient = gradient();
        return Termination::OutOfBudget;
    }
    // A few passes are always made, or a small budget would never get anywhere.
    const int least = options_.first_trials * options_.step.corrections * window;
    const int most =
        is_first_step() ? std::max(task_.most_updates, report_.updates + least) : task_.most_updates;
    // The energy to have fallen below for progress.
    const double progress = at_.energy - options_.step.progress_energy * at_.energy_scale();
    const int idle_before = at_.idle;
    const NewtonStep::Result result =
        NewtonStep(at_, wire_, contacts_, options_, smooth_, most, report_).take();
    bool stuck = result == NewtonStep::Result::NothingLower;
    assert(result != NewtonStep::Result::Accepted || std::isfinite(at_.energy));
    if (result == NewtonStep::Result::Accepted) {
        stuck = leads_nowhere(progress, idle_before);
    } else {  // trials have changed the model
        at_.linearise(wire_, contacts_, at_.model.first());
        sum_proximal();
        if (result == NewtonStep::Result::OutOfBudget) return Termination::OutOfBudget;
    }
    if (stuck && at_.model.first() == 1) return Termination::Stuck;
    if (stuck)
        open(segments_);
    else
        advance();
    return {};
}

/// Counts a step that was accepted as progress or as idle; whether too many were idle. The gradient is that
/// of the state before.
bool Descent::leads_nowhere(double progress, int idle_before) {
    const StepOptions& o = options_.step;
    assert(at_.idle > idle_before);
    if (terms().relative_gradient < o.progress_gradient * at_.best_gradient) {
        at_.best_gradient = terms().relative_gradient;
        at_.idle = 0;
    } else if (at_.energy > progress) {
        return at_.idle > o.most_idle;
    } else {
        at_.idle = idle_before;
    }
    return false;
}

/// At rest but not at a minimum: turns the worst segment a little down the negative curvature, the rest of
/// the wire answering as the recursion states. False where that is nowhere lower.
bool Descent::leave_saddle() {
    const SaddleOptions& o = options_.saddle;
    assert(at_.pivots.shifted > 0 && at_.model.first() == 1);
    for (double kick = o.kick; kick > o.least_kick; kick *= o.kick_factor)
        for (const double sign : {1.0, -1.0})
            if (turn_down(sign * kick)) return true;
    if (wire_.bent_segments() > 0) at_.restore_frames(wire_, at_.model.first());
    return false;
}

/// Turns the most distal segment, or shaft, whose pivot is not positive; whether the energy is then lower.
bool Descent::turn_down(double angle) {
    const RiccatiReport& pivots = at_.pivots;
    assert(pivots.stage < segments_);
    Vec2 direction = pivots.direction;
    if (direction.x() < 0 || (direction.x() == 0 && direction.y() < 0)) direction = -direction;
    if (pivots.stage < 0)
        at_.model.unwind(angle);
    else if (direction.isZero(0))
        at_.model.twist_one(pivots.stage, pivots.frame, angle);
    else
        at_.model.turn_one(pivots.stage, angle * direction);
    if (!std::isfinite(at_.model.roll_out(wire_))) return false;
    const double energy = at_.model.evaluate(wire_, contacts_);
    assert(std::isfinite(angle) && angle != 0);
    if (!std::isfinite(energy) || energy >= at_.energy) return false;
    at_.accept(wire_, contacts_, energy);
    return true;
}

/// After a move: the model of the new state.
void Descent::advance() {
    ++report_.newton_steps;
    report_.window = std::max(report_.window, at_.window(wire_));
    if (observer_) observer_(at_.model.first(), wire_);
    at_.linearise(wire_, contacts_, at_.model.first());
    proximal_known_ = at_.model.first() == 1;
    assert(!proximal_known_ || terms().proximal_gradient == 0);
    assert(report_.window <= segments_);
}

}  // namespace physics
