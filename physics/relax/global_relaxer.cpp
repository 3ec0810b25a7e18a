#include "physics/relax/global_relaxer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/relax/trust_search.h"
#include "physics/wire/bending.h"

namespace physics {
namespace {

constexpr double step_cap = 0.3;     // largest joint move of a step, in lumen radii
constexpr double kinked_cap = 0.03;  // of a wire with a kink, which leads to many rests
constexpr double free = 1e9;         // room of a joint that knows no lumen [mm]
constexpr int first_passes = 8;      // of a call, whatever its budget: all corrections of two trust regions
constexpr int corrections = 4;       // backward passes for one trust region, the wall corrected between them
constexpr int trust_passes = 40;     // changes of μ for one step
constexpr int foreseen_passes = 2;   // of them with foreseen forces
constexpr double armijo = 1e-4;      // share of the slope that the energy must fall by
constexpr double good_armijo = 0.2;  // the same as long as the wall can still be corrected
constexpr double corrected_share = 0.02;  // of the uncorrected slope that a corrected step must fall by
constexpr double crawling = 0.03;         // cap: an idle step below it is too short
constexpr double stiffening = 10;         // of μ after it
constexpr double trust_growth = 0.01;     // of μ after a step well inside its cap
constexpr double slow_growth = 0.25;      // the same where the energy rose first
constexpr int idle_before_search =
    30;  // of idle steps, before μ is looked for between too soft and too stiff
constexpr double forget_trust = 1e-8;     // μ below this share of its unit is none
constexpr double rounding_share = 1e-13;  // of the energy: less than this a line search can't see
constexpr double roundings = 4;           // of a joint's place, from joint to joint and in its distance
constexpr double progress = 1e-4;  // of the energy: a step that falls by less is idle, if the gradient stays
constexpr int idle = 400;          // of idle steps, before the wall is made softer
constexpr int rejected_on_planes = 3;    // values of μ, with which the energy rose
constexpr int idle_on_planes = 400;      // of idle steps, before a wall whose planes jump is left as it is
constexpr double sliding = 0.05;         // cap: an idle step beyond it moves the wire, and counts once
constexpr int hardly_moved = 10;         // times that any other idle step counts
constexpr int soft_passes = 400;         // over the whole wire, in each softer wall
constexpr double soft_start = 1.0;       // k λ²/C that always converges; continuation starts there
constexpr double smallest_pivot = 1e-6;  // of a recursion, over C
constexpr double saddle_kick = 1e-3;     // turn that leaves a saddle [rad]
constexpr double settled_share = 0.1;    // |dU/du| in a window over that proximal of it: time to widen
constexpr int widening = 8;              // of a window
constexpr int least_window = 32;         // segments
constexpr int changed_share = 2;         // segments of a window for each that changed
constexpr int margin = 8;                // segments of the window proximal of those
constexpr double predicted_cap = 1;      // largest joint move of a prediction, in lumen radii
constexpr double predicted_rise = 1;     // of the energy, by a prediction
constexpr double predicted_work = 4;     // of the hand's work
constexpr double predicted_well = 0.01;  // of energy and work: by less than this a prediction is as it is
constexpr double least_feed = 0.1;       // of λ, that is predicted
constexpr double least_turn = 0.1;       // that is predicted [rad]
constexpr double slides = 1e3;           // μ over its unit, with which a wire answers by sliding on
constexpr int predicted_window = 64;     // segments
constexpr int predicted_passes = 5;      // of one prediction over the whole wire, at most
constexpr int lag_rounds = 15;           // of normal forces and rest
constexpr double lag_tolerance = 1e-3;   // change of a normal force over the largest
constexpr int loose_rounds = 5;          // the first of them, from rests that need not be exact
constexpr double loose_gradient = 1e-5;  // |g|/C of such a rest
constexpr double fallen = 0.1;  // of |dU/du| in the window: time to look at that proximal of it again

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
    // Of several devices each has its own rest shape: the joint itself counts.
    if (wire.rest_angle[joint] == 0) return wire.tangents[joint].dot(wire.tangents[joint + 1]);
    return rest_direction(wire, joint, d[joint]).dot(wire.tangents[joint + 1]);
}

/// Whether the devices of two chains are the same at a joint, but for their roll.
bool same_devices(const Guidewire& a, const Guidewire& b, int joint) {
    if (a.devices.empty()) return true;
    if (a.thickness[joint + 1] != b.thickness[joint + 1]) return false;
    for (std::size_t k = 0; k < a.devices.size(); ++k) {
        const CoaxialDevice &one = a.devices[k], &other = b.devices[k];
        if (one.rigidity[joint] != other.rigidity[joint] || one.bend[joint] != other.bend[joint])
            return false;
    }
    return true;
}

/// What places of joints are rounded relative to [mm].
double farthest(const Guidewire& wire) {
    return wire.joints.back().cwiseAbs().maxCoeff() + wire.joints.front().cwiseAbs().maxCoeff();
}

/// What the wall's energy is rounded by, because joints are: it is far more than a share of the energy where
/// a hard wall bears much force with little energy [N·mm].
double rounding_of_places(const Guidewire& wire, const ContactSet& contacts, int first) {
    double force = 0;
    for (const WallContact& c : contacts.contacts().subspan(first))
        if (c.touches()) force += c.force();
    return roundings * std::numeric_limits<double>::epsilon() * farthest(wire) * force;
}

/// Whether a joint from `first` on turns by more than 60°.
bool kinked(const Guidewire& wire, int first) {
    for (int j = first; j < wire.segments(); ++j)
        if (wire.tangents[j].dot(wire.tangents[j + 1]) < 0.5) return true;
    return false;
}

}  // namespace

/// Model of the accepted state, the window from `first` on, and its minimum at the trust region as it is.
void GlobalRelaxer::linearise(const Guidewire& wire, const ContactSet& contacts, int first) {
    // What turns the shaft is all of the curved tip.
    const bool device_winds_up =
        std::any_of(wire.devices.begin(), wire.devices.end(),
                    [](const CoaxialDevice& device) { return windup_stiffness(device) > 0; });
    if (wire.windup_stiffness() > 0 || device_winds_up)
        first = std::max(1, std::min(first, wire.segments() - wire.bent_segments()));
    pivots_ = model_.linearise(wire, contacts, first, mu_);
}

void GlobalRelaxer::measure_window(const Guidewire& wire, const ContactSet& contacts) {
    const int first = model_.first();
    energy_ = contacts.energy(wire.joints, first) + grip_energy(wire.grips, wire.joints, first);
    for (int j = first - 1; j < wire.segments(); ++j) energy_ += joint_energy(wire, model_.directors, j);
    energy_ += 0.5 * wire.windup_torque() * wire.windup + windup_energy(wire) +
               twist_energy(wire, wire.twists, first);
    load_scale_ = contacts.load_scale(first);
}

void GlobalRelaxer::open_window(const Guidewire& wire, const ContactSet& contacts, int segments) {
    linearise(wire, contacts, std::max(1, wire.segments() - segments + 1));
    model_.sum_proximal(wire, contacts);
    measure_window(wire, contacts);
}

void GlobalRelaxer::accept(Guidewire& wire, ContactSet& contacts, double energy) {
    model_.take(wire);
    contacts.commit();
    energy_ = energy;
}

/// One Newton step.
GlobalRelaxer::Trial GlobalRelaxer::step(Guidewire& wire, ContactSet& contacts, int most_updates,
                                         RelaxReport& report) {
    const int first = model_.first(), window = wire.segments() - first + 1;
    const double part = kinked(wire, first - 1) ? kinked_cap : step_cap;
    double cap = free;
    for (const WallContact& c : contacts.contacts().subspan(first))
        if (c.room > 0) cap = std::min(cap, part * c.room);
    const double rounding = rounding_share * energy_scale() + rounding_of_places(wire, contacts, first);
    const double rounded = std::numeric_limits<double>::epsilon() * farthest(wire);  // joint's place
    int rejected = 0;
    TrustSearch search(mu_, mu_unit_);
    for (int pass = 0; pass < trust_passes && mu_ <= most_trust * mu_unit_; ++pass) {
        if (pass > 0) model_.take_contacts(wire, contacts, first, rejected < foreseen_passes);
        double uncorrected = 0;
        for (int correction = 0;; ++correction) {
            const bool solved = pass == 0 && correction == 0;  // as it was linearised
            if (!solved && report.updates > most_updates - window) return Trial::OutOfBudget;
            report.updates += window;
            if (!solved) model_.solve(wire, mu_);
            const double reach = model_.roll_out(wire) / cap;
            if (pass > 0 && reach * cap < rounded) return Trial::NothingLower;
            if (!(reach <= 1)) {
                if (!std::isfinite(reach)) ++report.rejected;
                search.raise(reach, pass == 0, correction > 0);
                break;
            }
            if (correction == 0 && rejected == 0 && idle_ >= idle_before_search && search.lower(reach)) break;
            const bool last = correction == corrections - 1;
            double energy = model_.evaluate(wire, contacts);
            const double expected = std::min(0.0, model_.slope());
            if (correction == 0) uncorrected = expected;
            // A corrected wall whose rest is where the wire is would let it stay there for ever.
            const double asked = std::min((last ? armijo : good_armijo) * expected,
                                          correction > 0 ? corrected_share * uncorrected : 0.0);
            bool falls = energy <= energy_ + asked;
            if (!falls && std::isfinite(energy)) {
                const Held held = contacts.hold();
                energy += held.energy;
                falls = energy <= energy_ + held.jump + asked;
            }
            // A fall too small to be seen is believed only of the model of the accepted state: the wall at a
            // trial state may have its rest where the wire is now, and then nothing would ever move.
            const bool unseen = correction == 0 && -expected < rounding && energy < energy_ + rounding;
            if (std::isfinite(energy) && (falls || unseen)) {
                report.largest_turn = std::max(report.largest_turn, model_.largest_turn());
                idle_ += reach > sliding ? 1 : hardly_moved;
                model_.foresee_forces(wire);
                accept(wire, contacts, energy);
                if (idle_ >= idle_before_search && pivots_.shifted > 0 && reach < crawling) {
                    // Pivots are shifted one by one: many of them make a step far too short, and a stiffer
                    // trust region, with which fewer are negative, a longer one.
                    mu_ = std::max(stiffening * mu_, least_trust * mu_unit_);
                    return Trial::Accepted;
                }
                // So that the next step just fits.
                mu_ *= std::clamp(reach * reach, rejected > 0 ? slow_growth : trust_growth, 1.0);
                if (mu_ < forget_trust * mu_unit_) mu_ = 0;
                return Trial::Accepted;
            }
            ++report.rejected;
            if (last) {
                if (++rejected == rejected_on_planes && !smooth_) return Trial::NothingLower;
                mu_ = std::max(4 * mu_, 1e-4 * mu_unit_);
                break;
            }
            model_.take_trial_contacts(wire, contacts);
        }
    }
    return Trial::NothingLower;
}

/// At rest but not at a minimum: turn the worst segment a little down the negative curvature, the rest of the
/// wire answering as the recursion states.
bool GlobalRelaxer::leave_saddle(Guidewire& wire, ContactSet& contacts) {
    Vec2 way = pivots_.way;
    if (way.x() < 0 || (way.x() == 0 && way.y() < 0)) way = -way;
    for (double kick = saddle_kick; kick > 1e-7; kick *= 0.25) {
        for (const double sign : {1.0, -1.0}) {
            if (pivots_.stage < 0)
                model_.unwind(wire, sign * kick);
            else if (way.isZero(0))
                model_.twist_one(pivots_.stage, sign * kick);
            else
                model_.turn_one(pivots_.stage, sign * kick * way);
            if (!std::isfinite(model_.roll_out(wire))) continue;
            const double energy = model_.evaluate(wire, contacts);
            if (!std::isfinite(energy) || energy >= energy_) continue;
            accept(wire, contacts, energy);
            return true;
        }
    }
    if (wire.bent_segments() > 0)  // trials have moved them
        transport_directors(wire, model_.first(), model_.directors);
    return false;
}

/// The trust region's unit is the wire's stiffness over the width of the lumen, whatever the segments'
/// length.
void GlobalRelaxer::set_units(const Guidewire& wire, const ContactSet& contacts) {
    double stiffest = 0, room = free;
    for (int j = 0; j < wire.segments(); ++j) stiffest = std::max(stiffest, wire.spring_constant(j));
    for (const WallContact& c : contacts.contacts())
        if (c.room > 0) room = std::min(room, c.room);
    const double length = wire.inserted_length() / wire.segments();
    mu_unit_ = stiffest * length / std::pow(room < free ? room : length, 4);
    model_.least_pivot = smallest_pivot * stiffest;
}

/// Stages of the segments up to `valid` are still those of the wire; the first window has that many segments.
GlobalRelaxer::Outcome GlobalRelaxer::descend(Guidewire& wire, ContactSet& contacts, int most_updates,
                                              int valid, int first_window, RelaxReport& report,
                                              const UpdateObserver& observer) {
    const int n = wire.segments();
    set_units(wire, contacts);
    const bool goes_on = std::exchange(goes_on_, false);
    if (goes_on)
        foreseen_ = n;
    else
        mu_ = idle_ = 0;
    const int idle_so_far = idle_;
    const double best_so_far = best_;
    model_.start(wire, contacts, foreseen_);
    foreseen_ = 0;
    linearise(wire, contacts, std::min(valid + 1, n));
    model_.sum_proximal(wire, contacts);
    const NewtonTerms& terms = model_.terms();
    bool proximal_known = true;  // of the accepted state
    double looked_at = 0;
    best_ = std::numeric_limits<double>::max();
    const int steps_before = report.newton_steps;
    const auto begin_window = [&] {
        proximal_known = true;
        best_ = std::numeric_limits<double>::max();
        idle_ = 0;
        looked_at = terms.relative_gradient;
    };
    const auto open = [&](int segments) {
        open_window(wire, contacts, segments);
        begin_window();
    };
    if (std::max(terms.relative_gradient, terms.proximal_gradient) > tolerance_) {
        // A model of the whole wire stands already.
        if (model_.first() == 1 && first_window >= n) {
            measure_window(wire, contacts);
            begin_window();
        } else {
            open(first_window);
        }
    }
    if (goes_on) idle_ = idle_so_far, best_ = best_so_far;
    for (;;) {
        const int window = n - model_.first() + 1;
        const bool settled =
            terms.relative_gradient <= std::max(tolerance_, settled_share * terms.proximal_gradient);
        if (!proximal_known && (settled || terms.relative_gradient < fallen * looked_at)) {
            model_.sum_proximal(wire, contacts);
            proximal_known = true;
            looked_at = terms.relative_gradient;
            continue;
        }
        report.gradient = std::max(terms.relative_gradient, terms.proximal_gradient);
        const bool affordable =
            report.newton_steps == steps_before || report.updates + window <= most_updates;
        if (proximal_known && report.gradient <= tolerance_) {
            // Only a rest that counts is certified.
            if (tolerance_ > config_.tolerance) return Outcome::Converged;
            if (const int moved = contacts.rejoin_vessels(wire); moved > 0) {
                open(n - moved + 1 + margin);
                continue;
            }
            // With twist a stage depends on the torque from all that is distal of it.
            if (terms.twist && model_.first() > 1) open(n);
            if (report.newton_steps > steps_before && report.updates + n > most_updates)
                return Outcome::OutOfBudget;
            report.updates += n;
            if (!model_.certifies()) pivots_ = model_.certify(wire, contacts);
            report.strict_minimum = pivots_.shifted == 0;
            if (report.strict_minimum) return Outcome::Converged;
            if (!affordable) return Outcome::OutOfBudget;
            mu_ = 0;
            open(n);
            pivots_ = model_.certify(wire, contacts);
            if (pivots_.shifted == 0 || !leave_saddle(wire, contacts)) return Outcome::Converged;
        } else if (settled) {
            open(widening * window);
            continue;
        } else {
            if (!affordable) {
                if (!proximal_known) model_.sum_proximal(wire, contacts);
                report.gradient = std::max(terms.relative_gradient, terms.proximal_gradient);
                return Outcome::OutOfBudget;
            }
            const int idle_before = idle_;
            const double before = energy_, least_fall = progress * energy_scale();
            // A few passes are always made, or a small budget would never get anywhere.
            const bool first_step = report.newton_steps == steps_before;
            const Trial trial = step(
                wire, contacts,
                first_step ? std::max(most_updates, report.updates + first_passes * window) : most_updates,
                report);
            bool stuck = trial == Trial::NothingLower;
            if (trial != Trial::Accepted) {
                linearise(wire, contacts, model_.first());
                model_.sum_proximal(wire, contacts);
                proximal_known = true;
                if (trial == Trial::OutOfBudget) return Outcome::OutOfBudget;
            } else if (terms.relative_gradient < 0.5 * best_) {
                best_ = terms.relative_gradient;
                idle_ = 0;
            } else if (energy_ > before - least_fall) {
                stuck = idle_ > (smooth_ ? idle : idle_on_planes);
            } else {
                idle_ = idle_before;
            }
            if (stuck && model_.first() == 1) return Outcome::Stuck;
            if (stuck) {
                open(n);
                continue;
            }
        }
        ++report.newton_steps;
        report.window = std::max(report.window, n - model_.first() + 1);
        if (observer) observer(model_.first(), wire);
        linearise(wire, contacts, model_.first());
        proximal_known = model_.first() == 1;
    }
}

/// The material frames become those of this wire.
void GlobalRelaxer::look_at(const Guidewire& wire) {
    if (wire.bent_segments() == 0) return;
    model_.directors[0] = rolled_director(wire);
    transport_directors(wire, 1, model_.directors);
}

/// A stiff wall lets only tiny steps through: find the way with a softer one, then harden it. The result
/// counts only if it is lower than before: a soft wall also lets the wire out of the vessel. Until then
/// `wire` stays where it was stuck, also where the budget ends.
GlobalRelaxer::Outcome GlobalRelaxer::descend_in_softer_walls(Guidewire& wire, int most_updates,
                                                              RelaxReport& report,
                                                              const UpdateObserver& observer) {
    const int n = wire.segments();
    double stiffness = 0, softest = std::numeric_limits<double>::max();
    for (const WallContact& c : contacts_.contacts()) stiffness = std::max(stiffness, c.stiffness);
    for (int j = 0; j < n; ++j)
        softest = std::min(softest, wire.spring_constant(j) / std::pow(wire.lengths[j + 1], 2));
    if (softening_.stiffness == 0) {
        open_window(wire, contacts_, n);
        softening_ = {soft_start * softest, energy_, 0, wire};
    } else {
        look_at(softening_.wire);
    }
    Softening& s = softening_;
    Outcome outcome = Outcome::Stuck;
    bool cut = false;  // by the call's budget
    for (;;) {
        const bool hardened = s.stiffness >= stiffness;
        const int before = report.updates, most = before + soft_passes * n - s.spent;
        if (hardened) {
            rebuild_joints(s.wire);
            contacts_.update(s.wire);
            outcome = descend(s.wire, contacts_, std::min(most_updates, most), 0, n, report, observer);
        } else {
            const SofterWall soft(wall_, s.stiffness / stiffness);
            ContactSet softened(soft);
            softened.reset(s.wire);
            outcome = descend(s.wire, softened, std::min(most_updates, most), 0, n, report, observer);
            open_window(s.wire, softened, n);
            report.wall_queries += softened.queries();
        }
        s.spent += report.updates - before;
        cut = outcome == Outcome::OutOfBudget && s.spent < soft_passes * n;
        if (cut || hardened) break;
        // The wall only gets harder, and the energy of the rest in it higher.
        if (!(energy_ < s.energy)) break;
        s.stiffness *= 10;
        s.spent = 0;
    }
    const double mu = mu_;
    mu_ = 0;  // a prediction takes these gains
    double reached = std::numeric_limits<double>::infinity();
    if (s.stiffness >= stiffness) {
        open_window(s.wire, contacts_, n);
        reached = energy_;
    }
    // What is lower in the wall itself counts, at rest or not.
    if (reached < s.energy) {
        wire = std::move(s.wire);
        softening_ = {};
        if (outcome == Outcome::OutOfBudget) mu_ = mu;
        return outcome;
    }
    look_at(wire);
    contacts_.update(wire);
    open_window(wire, contacts_, n);
    report.gradient = model_.terms().relative_gradient;
    report.strict_minimum = false;
    if (cut) {
        mu_ = mu;
        return Outcome::OutOfBudget;
    }
    softening_ = {};
    return Outcome::Stuck;
}

/// Proximal segments whose stages are as the last call left them.
int GlobalRelaxer::unchanged_segments(const Guidewire& wire) const {
    const int n = wire.segments(), both = std::min(n, end_.segments());
    if (end_.joints.empty() || wire.joints[0] != end_.joints[0] || wire.tangents[0] != end_.tangents[0] ||
        wire.load != end_.load || wire.spec.end_cells != end_.spec.end_cells ||
        wire.spec.segment_length != end_.spec.segment_length)
        return 0;
    if (wire.devices.size() != end_.devices.size() || wire.twists.empty() != end_.twists.empty()) return 0;
    int same = 0;
    while (same < both && wire.tangents[same + 1] == end_.tangents[same + 1] &&
           wire.lengths[same + 1] == end_.lengths[same + 1] && wire.rigidity[same] == end_.rigidity[same] &&
           wire.rest_angle[same] == end_.rest_angle[same] && same_devices(wire, end_, same) &&
           (wire.twists.empty() || wire.twists[same + 1] == end_.twists[same + 1]))
        ++same;
    if (wire.roll != end_.roll || wire.windup != end_.windup || wire.base_director != end_.base_director)
        same = std::min(same, n - wire.bent_segments());
    for (std::size_t k = 0; k < wire.devices.size(); ++k)
        if (wire.devices[k].roll != end_.devices[k].roll || wire.devices[k].windup != end_.devices[k].windup)
            same = std::min(same, n - wire.bent_segments());
    return same;
}

/// The same of its grips.
int GlobalRelaxer::unchanged_grips(const Guidewire& wire) const {
    const std::size_t both = std::min(wire.grips.size(), end_.grips.size());
    if (wire.grips.empty() != end_.grips.empty()) return 0;
    if (wire.grips.empty()) return wire.segments();
    std::size_t same = 1;
    while (same < both && wire.grips[same] == end_.grips[same]) ++same;
    return static_cast<int>(same) - 1;
}

bool GlobalRelaxer::knows(const Guidewire& wire) const {
    const int n = wire.segments();
    return end_report_.at_rest && n == end_.segments() && unchanged_segments(wire) == n &&
           unchanged_grips(wire) == n;
}

/// The normal forces of the grips become the contacts' own. False where they already are.
bool GlobalRelaxer::update_grips(Guidewire& wire) const {
    double largest = 0, change = 0;
    for (std::size_t j = 1; j < wire.grips.size(); ++j) {
        const double force = wire.friction_at(static_cast<int>(j)) * contacts_.contacts()[j].force();
        largest = std::max(largest, force);
        change = std::max(change, std::abs(force - wire.grips[j].force));
    }
    if (change <= lag_tolerance * largest) return false;
    const double stored = grip_energy(wire.grips, wire.joints, 1);
    for (std::size_t j = 1; j < wire.grips.size(); ++j) {
        const WallContact& c = contacts_.contacts()[j];
        wire.grips[j].force = wire.friction_at(static_cast<int>(j)) * c.force();
        if (!wire.grips[j].holds()) continue;
        wire.grips[j].normal = c.normal.normalized();
        if (!wire.twists.empty())
            wire.grips[j].around = 0.5 * wire.spec.diameter * wire.tangents[j].cross(wire.grips[j].normal);
    }
    wire.friction_loss += stored - grip_energy(wire.grips, wire.joints, 1);
    return true;
}

/// The wire's answer to a motion to first order, as the model's trial state; its steps are cut by μ. Returns
/// by how much it raises the energy, or no finite number where it goes farther than the model is good for.
double GlobalRelaxer::try_answer(Guidewire& wire, const FeedPlan& plan, double turn, double mu, double cap,
                                 double seen_rise) {
    FedStage fed[2];
    if (plan.change != 0) fed[0] = {plan.grows - 1, plan.change * wire.tangents[plan.grows]};
    if (plan.change_before != 0)
        fed[1] = {plan.grows - 2, plan.change_before * wire.tangents[plan.grows - 1]};
    const int first = model_.first(), whole = wire.segments(), window = whole - first + 1;
    auto rise = [&] {
        if (!(model_.roll_out(wire, turn, fed) <= cap)) return std::numeric_limits<double>::infinity();
        return model_.evaluate(wire, contacts_) - energy_;
    };
    if (!model_.answers()) {
        spent_ += whole;
        model_.certify(wire, contacts_);
        model_.look_from(first);
    }
    spent_ += window;
    model_.answer(wire, fed, mu);
    const double once = rise();
    if (!std::isfinite(once) || once <= seen_rise) return once;
    // Once more, with the wall as it is there.
    spent_ += window;
    model_.take_trial_contacts(wire, contacts_);
    model_.answer_again(wire, fed);
    const double again = rise();
    if (again < once) return again;
    spent_ += whole + window;
    model_.certify(wire, contacts_);
    model_.look_from(first);
    model_.answer(wire, fed, mu);
    return rise();
}

/// The wire starts from its answer to the motion. False where the answer is not known: the wire is not at
/// rest, or not this relaxer's.
bool GlobalRelaxer::predict(Guidewire& wire, HubMotion& motion, int most_updates) {
    const int n = wire.segments();
    if (!wire.devices.empty() || !wire.twists.empty() || !end_report_.converged || n != end_.segments() ||
        unchanged_segments(wire) < n || model_.stages() != n ||
        contacts_.contacts().size() != wire.joints.size())
        return false;
    double cap = free;
    for (const WallContact& c : contacts_.contacts())
        if (c.room > 0) cap = std::min(cap, predicted_cap * c.room);
    // A turn of the hub comes from the base.
    const bool twist = wire.curved_segments() > 0;
    model_.look_from(twist ? 1 : std::max(1, n - predicted_window + 1));
    measure_window(wire, contacts_);
    const double force = std::abs(end_report_.push_force);
    const std::vector<Grip> grips = wire.grips;  // as they are at rest
    const double windup = wire.windup;
    const bool winds = wire.windup_stiffness() > 0;
    const auto slide_back = [&] {
        wire.grips = grips;
        wire.windup = windup;
    };
    const double least_part = std::min({1.0, least_feed * wire.spec.segment_length / std::abs(motion.feed),
                                        least_turn / std::abs(motion.turn)});
    double part = 1, mu = 0;
    while (mu < slides * mu_unit_ && (spent_ == 0 || spent_ + predicted_passes * n <= most_updates)) {
        const FeedPlan plan = plan_feed(wire, part * motion.feed);
        if ((motion.feed != 0 && !plan.whole) || plan.grows <= model_.first()) {
            if (twist) transport_directors(wire, 1, model_.directors);
            return false;
        }
        if (winds) wire.windup += part * motion.turn;
        if (!grips.empty()) {
            double ignored = 0;
            wire.grips = fed_grips(wire, plan, ignored);
            model_.forget_answer();
        }
        if (winds || !grips.empty()) measure_window(wire, contacts_);
        const double work = predicted_work * force * std::abs(plan.mm), energy = std::abs(energy_);
        const double rise =
            try_answer(wire, plan, part * motion.turn, mu, cap, predicted_well * (energy + work));
        slide_back();
        if (rise <= predicted_rise * energy + work) {
            model_.foresee_forces(wire);
            // A segment may be merged with the one before it, and their joint goes.
            foreseen_ = plan.grows - 2;
            model_.take(wire);
            if (motion.feed != 0) apply_feed(wire, plan);
            rotate(wire, part * motion.turn);
            predicted_ = 2 * (n - plan.grows + 2);
            motion = {plan.mm, part * motion.turn};
            return true;
        }
        // A wire about to snap answers by more than that to any motion: less of the motion, then the answer
        // of a stiffer wire.
        if (part > least_part)
            part = std::max(least_part, 0.5 * part);
        else
            mu = std::max(least_trust * mu_unit_, 10 * mu);
    }
    if (twist) transport_directors(wire, 1, model_.directors);  // trials have moved them
    motion = {motion.feed == 0 ? 0 : feed(wire, part * motion.feed), part * motion.turn};
    rotate(wire, motion.turn);
    return true;
}

RelaxReport GlobalRelaxer::move(Guidewire& wire, HubMotion& motion, const RelaxBudget& budget) {
    motion.feed = std::clamp(motion.feed, -wire.spec.segment_length, wire.spec.segment_length);
    if (!wire.devices.empty()) {
        if (motion.feed != 0) motion.feed = feed_device(wire, motion.device, motion.feed);
        rotate_device(wire, motion.device, motion.turn);
    } else if (!predict(wire, motion, budget.updates)) {
        if (motion.feed != 0) motion.feed = feed(wire, motion.feed);
        rotate(wire, motion.turn);
    }
    return relax(wire, budget);
}

GlobalRelaxer::Outcome GlobalRelaxer::find_rest(Guidewire& wire, int most_updates, int valid,
                                                int first_window, RelaxReport& report,
                                                const UpdateObserver& observer) {
    if (softening_.stiffness == 0) {
        const Outcome outcome = descend(wire, contacts_, most_updates, valid, first_window, report, observer);
        if (outcome != Outcome::Stuck || !smooth_) return outcome;
    }
    return descend_in_softer_walls(wire, most_updates, report, observer);
}

RelaxReport GlobalRelaxer::relax(Guidewire& wire, const RelaxBudget& budget, const UpdateObserver& observer) {
    const int n = wire.segments();
    rebuild_joints(wire);
    const int unchanged = unchanged_segments(wire);
    RelaxReport report;
    report.updates = std::exchange(spent_, 0);
    const int same_grips = unchanged_grips(wire);
    const bool same = unchanged == n && n == end_.segments() && same_grips == n;
    if (same && end_report_.converged && wire.stations == end_.stations) {
        const int spent = report.updates;
        report = end_report_;
        report.updates = spent;
        report.newton_steps = report.window = report.rejected = 0;
        report.out_of_budget = false;
        report.wall_queries = 0;
        report.largest_turn = 0;
        return report;
    }
    if (wire.bent_segments() > 0) {
        const bool turned = end_.joints.empty() || wire.roll != end_.roll ||
                            wire.base_director != end_.base_director || model_.directors.empty();
        model_.directors.resize(wire.joints.size(), Vec3::Zero());
        model_.directors[0] = rolled_director(wire);
        transport_directors(wire, turned ? 1 : std::max(1, unchanged), model_.directors);
    } else {
        model_.directors.clear();
    }
    const long long asked_before = contacts_.queries();
    // A call that goes on where the budget ended keeps what it has learned.
    if (!end_report_.out_of_budget) {
        contacts_.release();
        lag_rounds_ = 0;
    }
    goes_on_ = same && end_report_.out_of_budget;
    if (!goes_on_) softening_ = {};
    contacts_.update(wire);
    const int moved = contacts_.rejoin_vessels(wire);
    // The last segment that is unchanged ends at a joint whose share of the wall may have changed.
    int valid = wire.load.isZero(0) ? std::max(0, std::min(unchanged, same_grips) - 1) : 0;
    if (moved > 0) valid = std::min(valid, moved - 1);
    const int most_updates = std::max(0, budget.updates);
    const int unsettled = end_report_.converged ? 0 : end_report_.window;
    const int changed = std::max(least_window, predicted_ > 0 ? predicted_ : changed_share * (n - unchanged));
    int window = std::max(changed, unsettled);
    Outcome outcome = Outcome::Converged;
    if (!wire.grips.empty()) {
        // Normal forces come near theirs from rests that need not be exact.
        tolerance_ = std::max(config_.tolerance, loose_gradient);
        while (outcome == Outcome::Converged && lag_rounds_ < loose_rounds) {
            ++report.lag_rounds;
            ++lag_rounds_;
            outcome = find_rest(wire, most_updates, valid, window, report, observer);
            valid = 0;
            window = n;
            if (outcome == Outcome::Converged && !update_grips(wire)) break;
        }
        tolerance_ = config_.tolerance;
    }
    predicted_ = 0;
    if (outcome == Outcome::Converged)
        outcome = find_rest(wire, most_updates, valid, window, report, observer);
    // Snaps back and forth may let the forces never agree: their rounds are counted over all such calls.
    while (outcome == Outcome::Converged && !wire.grips.empty() && lag_rounds_ < lag_rounds) {
        ++report.lag_rounds;
        ++lag_rounds_;
        if (!update_grips(wire)) break;
        outcome = find_rest(wire, most_updates, 0, n, report, observer);
    }
    rebuild_joints(wire);
    if (outcome == Outcome::Converged)
        for (std::size_t j = 0; j < wire.grips.size(); ++j)
            wire.friction_loss += wire.grips[j].follow(wire.joints[j]);
    for (int i = 1; i <= n; ++i) wire.stations[i] = contacts_.contacts()[i].station;

    report.converged = outcome == Outcome::Converged && report.strict_minimum;
    report.out_of_budget = outcome == Outcome::OutOfBudget;
    report.at_rest = outcome == Outcome::Converged;
    report.contacts = contacts_.touching();
    report.wall_queries += contacts_.queries() - asked_before;
    report.push_force = model_.terms().push.dot(wire.tangents[0]);
    report.base_torque = model_.terms().torque;
    double least = 1;
    for (int j = 0; j < n; ++j) least = std::min(least, straightness(wire, model_.directors, j));
    report.largest_bend = std::acos(std::max(-1.0, least));
    end_ = wire;
    end_report_ = report;
    return report;
}

}  // namespace physics
