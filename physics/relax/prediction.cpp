#include "physics/relax/prediction.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace physics {
namespace {

/// Distal segments whose rest a motion of the devices changes the most: from the shapes of those that move.
int moved_segments(const Chain& chain, int device) {
    double from = chain.inserted_length();
    for (int k = 0; k < static_cast<int>(chain.devices.size()); ++k)
        if (device == every_device || device == k)
            from = std::min(from, chain.devices[k].inserted - shaped_length(chain.devices[k].spec));
    int count = 0;
    for (double place = chain.inserted_length(); count < chain.segments() && place > from; ++count)
        place -= chain.lengths[chain.segments() - count];
    assert(count >= 0 && count <= chain.segments());
    return count;
}

class Predictor {
public:
    Predictor(Iterate& at, ContactSet& contacts, Chain& wire, const HubMotion& asked, double push_force,
              const GlobalOptions& options);

    Prediction run(HubMotion& motion, int most_updates);

private:
    /// A fraction of the motion.
    struct Part {
        double fraction = 1, mu = 0;
        double put_in = 0;  // energy, by hand [N·mm]
        FeedPlan plan;
    };

    double narrowest() const;
    double least_fraction() const;
    bool sliding_is_better(const Part& part) const {
        return !(part.mu < options_.prediction.sliding * at_.trust.unit());
    }
    bool possible(Part&) const;
    void prepare(Part&);
    void take_back();
    bool answers(const Part&);
    double answered(const Part&, double good_energy);
    double roll_out(std::span<const FedStage>);
    double put_in_by_hand() const;
    void prepare_gains();
    void make_less_of(Part&) const;
    HubMotion take(const Part&);
    HubMotion slide(const Part&);

    Iterate& at_;
    ContactSet& contacts_;
    Chain& wire_;
    const Chain rest_;  // where the motion begins
    const HubMotion asked_;
    const double push_;  // [N]
    const GlobalOptions& options_;
    const int first_;          // segment of the window: a turn of a hub comes from the base
    double cap_ = 0;           // largest move of a joint [mm]
    double least_ = 0;         // least fraction of the motion
    double least_energy_ = 0;  // [N·mm]
    int updates_ = 0;
};

Predictor::Predictor(Iterate& at, ContactSet& contacts, Chain& wire, const HubMotion& asked,
                     double push_force, const GlobalOptions& options)
    : at_(at),
      contacts_(contacts),
      wire_(wire),
      rest_(wire),
      asked_(asked),
      push_(std::abs(push_force)),
      options_(options),
      first_(wire.bent_segments() > 0 ? 1 : std::max(1, wire.segments() - options.prediction.window + 1)) {
    assert(std::isfinite(asked.feed) && std::isfinite(asked.turn));
    assert(std::abs(asked.feed) <= wire.grid.segment_length);
    cap_ = narrowest();
    least_ = least_fraction();
    double stiffness = 0;
    for (int j = first_ - 1; j < wire.segments(); ++j) stiffness += wire.spring_constant(j);
    least_energy_ = 0.5 * stiffness * options.prediction.least_turned * options.prediction.least_turned;
    assert(cap_ > 0 && least_energy_ > 0);
}

/// The narrowest lumen's radius, or the way that a vessel has made for a joint [mm].
double Predictor::narrowest() const {
    assert(contacts_.contacts().size() == wire_.joints.size());
    double cap = options_.trust.unbounded;
    for (const WallContact& c : contacts_.contacts())
        if (c.clearance > 0) cap = std::min(cap, std::max(c.clearance, c.given.norm()));
    return cap;
}

double Predictor::least_fraction() const {
    const PredictionOptions& o = options_.prediction;
    const double fraction = std::min({1.0, o.least_feed * wire_.grid.segment_length / std::abs(asked_.feed),
                                      o.least_turn / std::abs(asked_.turn)});
    assert(fraction > 0 && fraction <= 1);
    return fraction;
}

Prediction Predictor::run(HubMotion& motion, int most_updates) {
    const int n = wire_.segments();
    at_.model.look_from(first_);
    at_.measure_window(wire_, contacts_);
    assert(least_ > 0 && least_ <= 1);
    Part part;
    while (!sliding_is_better(part) &&
           (updates_ == 0 || updates_ + options_.prediction.most_passes * n <= most_updates)) {
        if (!possible(part)) return {false, updates_, 0};
        prepare(part);
        if (!at_.model.has_frames_of(wire_)) {  // a device's shape has come in, or is out
            take_back();
            return {false, updates_, 0};
        }
        if (answers(part)) {
            motion = take(part);
            assert(motion.feed * asked_.feed >= 0 && std::abs(motion.feed) <= std::abs(asked_.feed));
            return {true, updates_, 2 * (moved_segments(wire_, asked_.device) + 2)};
        }
        take_back();
        make_less_of(part);
    }
    motion = slide(part);
    return {true, updates_, 0};
}

/// Makes the part's plan. False where the chain has first to be made whole, or the window is too short.
bool Predictor::possible(Part& part) const {
    assert(part.fraction > 0 && part.fraction <= 1);
    part.plan = {};
    if (asked_.feed == 0) return true;
    part.plan = plan_feed(wire_, asked_.device, part.fraction * asked_.feed);
    assert(std::abs(part.plan.mm) <= std::abs(asked_.feed));
    return part.plan.whole && part.plan.grows > first_;
}

/// Energy of twist and grips, which a motion changes before the chain answers [N·mm].
double Predictor::put_in_by_hand() const {
    assert(wire_.segments() == rest_.segments() && first_ <= wire_.segments());
    return twist_energy(wire_, first_) + grip_energy(wire_.grips, wire_.joints, first_);
}

/// Feeds and turns the devices.
void Predictor::prepare(Part& part) {
    if (!at_.model.answers()) prepare_gains();
    part.put_in = -put_in_by_hand();
    if (part.plan.mm != 0) stretch(wire_, part.plan);
    rotate(wire_, asked_.device, part.fraction * asked_.turn);
    part.put_in += put_in_by_hand();
    assert(validate(wire_).empty());
}

void Predictor::take_back() {
    assert(wire_.segments() == rest_.segments());
    wire_ = rest_;
    contacts_.refit(wire_);
    if (first_ == 1 && wire_.bent_segments() > 0) at_.restore_frames(wire_, 1);  // trials have moved them
}

/// Whether the answer of the chain that was fed and turned is one that the model is good for; it is then the
/// model's trial state.
bool Predictor::answers(const Part& part) {
    assert(wire_.segments() == rest_.segments());
    const PredictionOptions& o = options_.prediction;
    const double start = at_.energy + part.put_in;
    wire_.joints = rest_.joints;  // from which the model counts moves, those by the feed among them
    contacts_.refit(wire_);
    at_.model.update_slopes(wire_, contacts_);
    const double work = o.most_work * push_ * std::abs(part.plan.mm),
                 size = std::max(std::abs(start), least_energy_);
    return answered(part, start + o.good_fraction * (size + work)) <= start + size + work;
}

/// The gains become those of the whole wire at rest.
void Predictor::prepare_gains() {
    const int first = at_.model.first();
    at_.model.certify(wire_, contacts_);
    at_.model.look_from(first);
    updates_ += wire_.segments();
    assert(at_.model.answers());
}

/// Energy of the rolled out answer [N·mm]; infinite where it goes too far.
double Predictor::roll_out(std::span<const FedStage> fed) {
    assert(at_.model.first() == first_);
    if (!(at_.model.roll_out(wire_, fed) <= cap_)) return std::numeric_limits<double>::infinity();
    return at_.model.evaluate(wire_, contacts_);
}

/// The same of the answer, with its steps cut by μ; made once more with the wall as it is there if it is
/// above `good_energy`, and the lower of the two is the model's trial state.
double Predictor::answered(const Part& part, double good_energy) {
    const FeedPlan& plan = part.plan;
    assert(plan.grows <= wire_.segments() && part.mu >= 0);
    FedStage fed[2];
    if (plan.change != 0) fed[0] = {plan.grows - 1, plan.change * wire_.tangents[plan.grows]};
    if (plan.change_before != 0)
        fed[1] = {plan.grows - 2, plan.change_before * wire_.tangents[plan.grows - 1]};
    const int window = at_.window(wire_);
    updates_ += window;
    at_.model.answer(wire_, fed, part.mu);
    const double once = roll_out(fed);
    if (!std::isfinite(once) || once <= good_energy) return once;
    updates_ += window;
    at_.model.keep_trial();
    at_.model.take_trial_contacts(wire_, contacts_);
    at_.model.answer_again(wire_, fed);
    const double again = roll_out(fed);
    if (again < once) return again;
    at_.model.restore_trial();
    return once;
}

/// A wire about to snap answers by more than the model is good for to any motion: less of the motion, then
/// the answer of a stiffer wire.
void Predictor::make_less_of(Part& part) const {
    if (part.fraction > least_)
        part.fraction = std::max(least_, 0.5 * part.fraction);
    else
        part.mu = std::max(options_.trust.least_fraction * at_.trust.unit(),
                           options_.prediction.stiffening * part.mu);
    assert(part.fraction >= least_ && part.mu >= 0);
}

/// The wire takes its answer. Returns the motion that was made.
HubMotion Predictor::take(const Part& part) {
    assert(part.fraction > 0);
    at_.model.predict_contact_forces(wire_);
    at_.model.take(wire_);
    rebuild_joints(wire_);
    const int segments = wire_.segments(), leading = wire_.leading;
    const int changes_from = first_growing(wire_);
    regrid(wire_, part.plan);
    // Where segments are split or merged, or another device leads, joints from there on are others.
    const bool same = wire_.segments() == segments && wire_.leading == leading;
    at_.foreseen = same ? segments : std::max(0, changes_from - 2);
    assert(at_.foreseen <= wire_.segments());
    return {part.plan.mm, part.fraction * asked_.turn, asked_.device};
}

/// The devices are fed and turned without an answer.
HubMotion Predictor::slide(const Part& part) {
    assert(part.fraction > 0);
    const HubMotion made{asked_.feed == 0 ? 0 : feed(wire_, asked_.device, part.fraction * asked_.feed),
                         part.fraction * asked_.turn, asked_.device};
    rotate(wire_, asked_.device, made.turn);
    return made;
}

}  // namespace

Prediction predict(Iterate& at, ContactSet& contacts, Chain& wire, HubMotion& motion, double push_force,
                   int most_updates, const GlobalOptions& options) {
    assert(at.model.stages() == wire.segments());
    assert(contacts.contacts().size() == wire.joints.size());
    return Predictor(at, contacts, wire, motion, push_force, options).run(motion, most_updates);
}

}  // namespace physics
