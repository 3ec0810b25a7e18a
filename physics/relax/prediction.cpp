#include "physics/relax/prediction.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace physics {
namespace {

class Predictor {
public:
    Predictor(Iterate& at, ContactSet& contacts, Guidewire& wire, const HubMotion& asked, double push_force,
              const GlobalOptions& options);

    Prediction run(HubMotion& motion, int most_updates);

private:
    /// A share of the motion.
    struct Part {
        double share = 1, mu = 0;
        FeedPlan plan;
    };

    double narrowest() const;
    double least_share() const;
    bool sliding_is_better(const Part& part) const {
        return !(part.mu < options_.prediction.sliding * at_.trust.unit());
    }
    bool answers(Part&);
    double rise(const Part&, double good_rise);
    double roll_out(const Part&, std::span<const FedStage>);
    void prepare_gains();
    void make_less_of(Part&) const;
    HubMotion take(const Part&);
    HubMotion slide(const Part&);
    void restore_frames() {
        if (twist_) at_.restore_frames(wire_, 1);
    }

    Iterate& at_;
    ContactSet& contacts_;
    Guidewire& wire_;
    const HubMotion asked_;
    const double push_;  // [N]
    const GlobalOptions& options_;
    const bool twist_;  // a turn of the hub comes from the base
    double cap_ = 0;    // largest move of a joint [mm]
    double least_ = 0;  // least share of the motion
    int updates_ = 0;
};

Predictor::Predictor(Iterate& at, ContactSet& contacts, Guidewire& wire, const HubMotion& asked,
                     double push_force, const GlobalOptions& options)
    : at_(at),
      contacts_(contacts),
      wire_(wire),
      asked_(asked),
      push_(std::abs(push_force)),
      options_(options),
      twist_(wire.curved_segments() > 0) {
    assert(std::isfinite(asked.feed) && std::isfinite(asked.turn));
    assert(std::abs(asked.feed) <= wire.spec.segment_length);
    cap_ = narrowest();
    least_ = least_share();
}

/// The narrowest lumen's radius [mm].
double Predictor::narrowest() const {
    double cap = options_.trust.unbounded;
    for (const WallContact& c : contacts_.contacts())
        if (c.room > 0) cap = std::min(cap, c.room);
    return cap;
}

double Predictor::least_share() const {
    const PredictionOptions& o = options_.prediction;
    const double share = std::min({1.0, o.least_feed * wire_.spec.segment_length / std::abs(asked_.feed),
                                   o.least_turn / std::abs(asked_.turn)});
    assert(share > 0);
    return share;
}

Prediction Predictor::run(HubMotion& motion, int most_updates) {
    const int n = wire_.segments();
    at_.model.look_from(twist_ ? 1 : std::max(1, n - options_.prediction.window + 1));
    at_.measure_window(wire_, contacts_);
    assert(least_ > 0 && least_ <= 1);
    Part part;
    while (!sliding_is_better(part) &&
           (updates_ == 0 || updates_ + options_.prediction.most_passes * n <= most_updates)) {
        part.plan = plan_feed(wire_, part.share * asked_.feed);
        if ((asked_.feed != 0 && !part.plan.whole) || part.plan.grows <= at_.model.first()) {
            restore_frames();
            return {false, updates_, 0};
        }
        if (answers(part)) {
            motion = take(part);
            return {true, updates_, 2 * (n - part.plan.grows + 2)};
        }
        make_less_of(part);
    }
    motion = slide(part);
    return {true, updates_, 0};
}

/// Whether the wire's answer is one that the model is good for; it is then the model's trial state.
bool Predictor::answers(Part& part) {
    const std::vector<Grip> grips = wire_.grips;  // as they are at rest
    assert(grips.empty() || grips.size() == wire_.joints.size());
    const double windup = wire_.windup;
    const bool winds = wire_.windup_stiffness() > 0;
    if (winds) wire_.windup += part.share * asked_.turn;
    if (!grips.empty()) {
        double ignored = 0;
        wire_.grips = fed_grips(wire_, part.plan, ignored);
        at_.model.forget_answer();
    }
    if (winds || !grips.empty()) at_.measure_window(wire_, contacts_);
    const PredictionOptions& o = options_.prediction;
    const double work = o.most_work * push_ * std::abs(part.plan.mm), energy = std::abs(at_.energy);
    const double rise = this->rise(part, o.good_share * (energy + work));
    wire_.grips = grips;
    wire_.windup = windup;
    return rise <= energy + work;
}

/// The gains become those of the whole wire at rest.
void Predictor::prepare_gains() {
    const int first = at_.model.first();
    at_.model.certify(wire_, contacts_);
    at_.model.look_from(first);
    updates_ += wire_.segments();
    assert(at_.model.answers());
}

/// By how much the rolled out answer raises the energy [N·mm]; infinite where it goes too far.
double Predictor::roll_out(const Part& part, std::span<const FedStage> fed) {
    if (!(at_.model.roll_out(wire_, part.share * asked_.turn, fed) <= cap_))
        return std::numeric_limits<double>::infinity();
    return at_.model.evaluate(wire_, contacts_) - at_.energy;
}

/// The same of the answer, with its steps cut by μ; made once more with the wall as it is there if it rises
/// by more than `good_rise`.
double Predictor::rise(const Part& part, double good_rise) {
    const FeedPlan& plan = part.plan;
    assert(plan.grows > at_.model.first() && plan.grows <= wire_.segments() && part.mu >= 0);
    FedStage fed[2];
    if (plan.change != 0) fed[0] = {plan.grows - 1, plan.change * wire_.tangents[plan.grows]};
    if (plan.change_before != 0)
        fed[1] = {plan.grows - 2, plan.change_before * wire_.tangents[plan.grows - 1]};
    const int window = at_.window(wire_);
    if (!at_.model.answers()) prepare_gains();
    updates_ += window;
    at_.model.answer(wire_, fed, part.mu);
    const double once = roll_out(part, fed);
    if (!std::isfinite(once) || once <= good_rise) return once;
    updates_ += window;
    at_.model.take_trial_contacts(wire_, contacts_);
    at_.model.answer_again(wire_, fed);
    const double again = roll_out(part, fed);
    if (again < once) return again;
    prepare_gains();
    updates_ += window;
    at_.model.answer(wire_, fed, part.mu);
    return roll_out(part, fed);
}

/// A wire about to snap answers by more than the model is good for to any motion: less of the motion, then
/// the answer of a stiffer wire.
void Predictor::make_less_of(Part& part) const {
    if (part.share > least_)
        part.share = std::max(least_, 0.5 * part.share);
    else
        part.mu =
            std::max(options_.trust.least_share * at_.trust.unit(), options_.prediction.stiffening * part.mu);
    assert(part.share >= least_ && part.mu >= 0);
}

/// The wire takes its answer. Returns the motion that was made.
HubMotion Predictor::take(const Part& part) {
    assert(part.share > 0);
    at_.model.foresee_forces(wire_);
    // A segment may be merged with the one before it, and their joint goes.
    at_.foreseen = part.plan.grows - 2;
    at_.model.take(wire_);
    if (asked_.feed != 0) apply_feed(wire_, part.plan);
    rotate(wire_, part.share * asked_.turn);
    assert(at_.foreseen >= 0 && at_.foreseen <= wire_.segments());
    return {part.plan.mm, part.share * asked_.turn};
}

/// The wire is fed and turned without an answer.
HubMotion Predictor::slide(const Part& part) {
    assert(part.share > 0);
    restore_frames();
    const HubMotion made{asked_.feed == 0 ? 0 : feed(wire_, part.share * asked_.feed),
                         part.share * asked_.turn};
    rotate(wire_, made.turn);
    return made;
}

}  // namespace

bool predictable(const Guidewire& wire) {
    return wire.devices.empty() && wire.twists.empty();
}

Prediction predict(Iterate& at, ContactSet& contacts, Guidewire& wire, HubMotion& motion, double push_force,
                   int most_updates, const GlobalOptions& options) {
    assert(predictable(wire) && at.model.stages() == wire.segments());
    assert(contacts.contacts().size() == wire.joints.size());
    return Predictor(at, contacts, wire, motion, push_force, options).run(motion, most_updates);
}

}  // namespace physics
