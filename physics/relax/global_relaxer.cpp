#include "physics/relax/global_relaxer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "physics/geometry/maths.h"
#include "physics/relax/descent.h"
#include "physics/relax/prediction.h"
#include "physics/wire/bending.h"
#include "physics/wire/friction.h"

namespace physics {
namespace {

/// Cosine of the angle of a joint away from its rest shape.
double straightness(const Chain& wire, const std::vector<Vec3>& d, int joint) {
    const Vec3 &u = wire.tangents[joint], &next = wire.tangents[joint + 1];
    assert(std::abs(u.squaredNorm() - 1) < 1e-9);
    // Several devices that bend have no rest shape in common: the joint itself counts.
    if (wire.devices.size() > 1 || wire.devices[0].rest[joint].angle == 0) return u.dot(next);
    return rest_direction(u, rest_bend(wire.devices[0], joint, u, d[joint])).dot(next);
}

/// Largest turn of a joint from its rest shape [rad].
double largest_bend(const Chain& wire, const std::vector<Vec3>& directors) {
    double least = 1;
    for (int j = 0; j < wire.segments(); ++j) least = std::min(least, straightness(wire, directors, j));
    assert(least <= 1);
    return geometry::acos(std::max(-1.0, least));
}

/// Entries from `first` on that two lists have in common, of `most`.
template <class T>
int common(const std::vector<T>& a, const std::vector<T>& b, int first, int most) {
    assert(std::min(a.size(), b.size()) >= static_cast<std::size_t>(first + most));
    const auto begin = a.begin() + first;
    return static_cast<int>(std::mismatch(begin, begin + most, b.begin() + first).first - begin);
}

/// Proximal segments, each with the joint before it, that are made alike in both chains, but for their
/// frames.
int same_material(const Chain& a, const Chain& b, int most) {
    assert(a.devices.size() == b.devices.size());
    most = common(a.rigidity, b.rigidity, 0, most);
    most = common(a.thickness, b.thickness, 1, most);
    for (std::size_t k = 0; k < a.devices.size(); ++k) {
        const Device &one = a.devices[k], &other = b.devices[k];
        most = common(one.rigidity, other.rigidity, 0, most);
        most = common(one.rest, other.rest, 0, most);
        if (one.wound.empty()) continue;
        most = common(one.wound, other.wound, 1, most);
        most = common(one.torsion, other.torsion, 1, most);
    }
    return most;
}

/// Whether the hubs of two wires are turned alike, or their devices'.
bool same_turns(const Chain& a, const Chain& b) {
    assert(a.devices.size() == b.devices.size());
    if (a.base_director != b.base_director) return false;
    for (std::size_t k = 0; k < a.devices.size(); ++k)
        if (a.devices[k].roll != b.devices[k].roll || a.devices[k].windup != b.devices[k].windup ||
            a.devices[k].windup_stiffness != b.devices[k].windup_stiffness)
            return false;
    return true;
}

/// Whether no segment of two wires can have the same stage.
bool differ_throughout(const Chain& a, const Chain& b) {
    assert(!a.joints.empty());
    return b.joints.empty() || a.joints[0] != b.joints[0] || a.tangents[0] != b.tangents[0] ||
           a.load != b.load || a.grid.end_cells != b.grid.end_cells ||
           a.grid.segment_length != b.grid.segment_length || a.devices.size() != b.devices.size() ||
           !std::equal(a.devices.begin(), a.devices.end(), b.devices.begin(),
                       [](const Device& one, const Device& other) {
                           return one.wound.empty() == other.wound.empty();
                       });
}

/// Proximal segments whose stages are the same in both wires.
int same_segments(const Chain& a, const Chain& b) {
    if (differ_throughout(a, b)) return 0;
    assert(a.tangents.size() == a.joints.size() && b.tangents.size() == b.joints.size());
    const int n = a.segments();
    int same = common(a.tangents, b.tangents, 1, std::min(n, b.segments()));
    same = same_material(a, b, common(a.lengths, b.lengths, 1, same));
    if (!same_turns(a, b)) same = std::min(same, std::max(0, n - a.bent_segments()));
    assert(same >= 0 && same <= n);
    return same;
}

/// Proximal segments whose grips are the same.
int same_grips(const Chain& a, const Chain& b) {
    if (a.grips.empty() != b.grips.empty()) return 0;
    if (a.grips.empty()) return a.segments();
    assert(a.grips.size() == a.joints.size() && b.grips.size() == b.joints.size());
    return common(a.grips, b.grips, 1, std::min(a.segments(), b.segments()));
}

}  // namespace

GlobalRelaxer::GlobalRelaxer(const RelaxerConfig& config, const LumenWall& wall, const GlobalOptions& options)
    : options_(options),
      tolerance_(config.tolerance),
      wall_(wall),
      smooth_(wall.smooth()),
      at_(options.trust),
      lag_(options.lag),
      contacts_(wall) {
    assert(tolerance_ > 0);
}

GlobalRelaxer::Unchanged GlobalRelaxer::unchanged(const Chain& wire) const {
    const int n = wire.segments(), segments = same_segments(wire, end_), grips = same_grips(wire, end_);
    assert(grips >= 0 && grips <= n);
    return {segments, grips,
            segments == n && grips == n && n == end_.segments() && wire.stations == end_.stations &&
                wire.friction_loss == end_.friction_loss};
}

void GlobalRelaxer::forget() {
    contacts_.forget();
    end_ = {};
    end_report_ = {};
    predicted_ = spent_ = 0;
}

bool GlobalRelaxer::knows(const Chain& wire) const {
    return end_report_.at_rest() && unchanged(wire).all;
}

RelaxReport GlobalRelaxer::move(Chain& wire, HubMotion& motion, const RelaxBudget& budget) {
    assert(std::isfinite(motion.feed) && std::isfinite(motion.turn));
    motion.feed = std::clamp(motion.feed, -wire.grid.segment_length, wire.grid.segment_length);
    if (!predict_motion(wire, motion, budget.updates)) {
        if (motion.feed != 0) motion.feed = feed(wire, motion.device, motion.feed);
        rotate(wire, motion.device, motion.turn);
    }
    assert(std::abs(motion.feed) <= wire.grid.segment_length && validate(wire).empty());
    return relax(wire, budget);
}

/// False where the answer is not known: the wire is not at rest, or not this relaxer's.
bool GlobalRelaxer::predict_motion(Chain& wire, HubMotion& motion, int most_updates) {
    if (!end_report_.converged() || !unchanged(wire).all || at_.model.stages() != wire.segments())
        return false;
    const Prediction prediction =
        predict(at_, contacts_, wire, motion, end_report_.push_force, most_updates, options_);
    assert(prediction.updates >= 0 && prediction.changed >= 0);
    assert(std::isfinite(motion.feed) && std::isfinite(motion.turn));
    spent_ = prediction.updates;
    if (prediction.changed > 0) predicted_ = prediction.changed;
    return prediction.made;
}

RelaxReport GlobalRelaxer::relax(Chain& wire, const RelaxBudget& budget, const UpdateObserver& observer) {
    return search(wire, budget.updates, observer, [this](Search& s) { return find_equilibrium(s); });
}

RelaxReport GlobalRelaxer::recall(Chain& wire) {
    return search(wire, 2 * wire.segments(), {}, [this](Search& s) { return find_rest(s); });
}

template <class Find>
RelaxReport GlobalRelaxer::search(Chain& wire, int most_updates, const UpdateObserver& observer, Find find) {
    rebuild_joints(wire);
    const Unchanged same = unchanged(wire);
    assert(wire.segments() >= 1 && spent_ >= 0);
    RelaxReport report;
    report.updates = std::exchange(spent_, 0);
    if (same.all && end_report_.converged()) return nothing_to_do(report.updates);
    take_up_frames(wire, same.segments);
    const long long asked_before = contacts_.queries();
    Search search{wire, observer, report, take_up(wire, same, std::max(0, most_updates))};
    const Termination end = find(search);
    assert(at_.model.stages() == wire.segments() && report.updates >= 0);
    report.wall_queries += contacts_.queries() - asked_before;
    finish(wire, end, report);
    return report;
}

/// Report on a wire that is where it was at rest.
RelaxReport GlobalRelaxer::nothing_to_do(int updates) const {
    assert(end_report_.converged());
    RelaxReport report = end_report_;
    report.updates = updates;
    report.newton_steps = report.window = report.rejected = 0;
    report.wall_queries = 0;
    report.largest_turn = 0;
    return report;
}

/// The material frames become the wire's, of which proximal ones are unchanged.
void GlobalRelaxer::take_up_frames(const Chain& wire, int unchanged_segments) {
    assert(unchanged_segments >= 0 && unchanged_segments <= wire.segments());
    std::vector<Vec3>& directors = at_.model.directors;
    if (wire.bent_segments() == 0) {
        directors.clear();
        return;
    }
    const bool turned = end_.joints.empty() || wire.base_director != end_.base_director || directors.empty();
    directors.resize(wire.joints.size(), Vec3::Zero());
    directors[0] = wire.base_director;
    at_.restore_frames(wire, turned ? 1 : std::max(1, unchanged_segments));
}

/// The contacts become the wire's. Returns what the first descent is asked for.
DescentTask GlobalRelaxer::take_up(Chain& wire, const Unchanged& same, int most_updates) {
    assert(most_updates >= 0);
    const int n = wire.segments();
    // A call that goes on where the budget ended keeps what it has learned.
    if (!end_report_.out_of_budget()) {
        contacts_.release();
        lag_.forget();
    }
    at_.goes_on = same.all && end_report_.out_of_budget();
    if (!at_.goes_on) softer_walls_.forget();
    if (const Foundation* vessels = vessels_that_move(wire)) LaggedYields::prepare(wire, *vessels);
    contacts_.update(wire);
    const int moved = contacts_.rejoin_vessels(wire);
    // The last segment that is unchanged ends at a joint whose fraction of the wall may have changed.
    int valid = wire.load.isZero(0) ? std::max(0, std::min(same.segments, same.grips) - 1) : 0;
    if (moved > 0) valid = std::min(valid, moved - 1);
    assert(valid >= 0 && valid <= n && contacts_.contacts().size() == wire.joints.size());
    const WindowOptions& o = options_.window;
    const int unsettled = end_report_.converged() ? 0 : end_report_.window;
    const int changed = std::max(o.least, predicted_ > 0 ? predicted_ : o.per_changed * (n - same.segments));
    return {most_updates, valid, std::max(changed, unsettled), tolerance_, true};
}

/// Rest and what is held meanwhile in turn, normal forces and the vessels' ways, until they agree. Snaps back
/// and forth may let them never agree: the rounds are counted over all calls that their budget has cut.
Termination GlobalRelaxer::find_equilibrium(Search& search) {
    Chain& wire = search.wire;
    const bool grips = !wire.grips.empty();
    assert(!grips || wire.grips.size() == wire.joints.size());
    const auto whole_wire = [&] { search.task.valid = 0, search.task.first_window = wire.segments(); };
    const auto next_round = [&] {
        if (!lag_.next_round()) return false;
        ++search.report.lag_rounds;
        return true;
    };
    // Vessels that have moved are asked for anew.
    const auto update = [&] {
        if (!lag_.update(wire, contacts_.contacts(), wall_, vessels_that_move(wire))) return false;
        if (vessels_that_move(wire)) contacts_.update(wire);
        return true;
    };
    assert(search.task.most_updates >= 0);
    // Normal forces come near theirs from rests that need not be exact.
    search.task.tolerance = std::max(tolerance_, options_.lag.loose_gradient);
    search.task.certifies = !(search.task.tolerance > tolerance_);
    Termination end = Termination::Stationary;
    while (grips && at_rest(end) && lag_.rounds() < options_.lag.loose_rounds && next_round()) {
        end = find_rest(search);
        whole_wire();
        if (at_rest(end) && !update()) break;
    }
    predicted_ = 0;
    search.task.tolerance = tolerance_;
    search.task.certifies = !grips;
    while (at_rest(end)) {
        const int steps = search.report.newton_steps;
        end = find_rest(search);
        whole_wire();
        if (!grips || !at_rest(end)) break;
        if (search.task.certifies && search.report.newton_steps == steps) break;
        search.task.certifies = !(next_round() && update()) && !lag_.let_go(wire, contacts_.contacts());
    }
    assert(lag_.rounds() <= options_.lag.most_rounds);
    if (at_rest(end)) lag_.close(wire, contacts_.contacts());
    return end;
}

/// Rest with the grips' forces as they are.
Termination GlobalRelaxer::find_rest(Search& search) {
    assert(search.task.first_window >= 1);
    if (!softer_walls_.under_way()) {
        const Termination end = Descent(at_, search.wire, contacts_, options_, smooth_, search.task,
                                        search.report, search.observer)
                                    .run();
        if (end != Termination::Stuck || !smooth_) return end;
    }
    const WallDescent own{wall_, contacts_, options_, search.report, search.observer};
    return softer_walls_.run(at_, search.wire, own, search.task);
}

/// The wire's own joints, grips and stations, the report on it, and what the next call remembers.
void GlobalRelaxer::finish(Chain& wire, Termination end, RelaxReport& report) {
    assert(contacts_.contacts().size() == wire.joints.size());
    rebuild_joints(wire);
    if (at_rest(end)) follow_grips(wire);
    for (int i = 1; i <= wire.segments(); ++i) {
        wire.stations[i] = contacts_.contacts()[i].station;
        if (!wire.grips.empty()) wire.grips[i].given = contacts_.contacts()[i].given;
    }
    report.termination = end;
    report.contacts = contacts_.touching();
    report.push_force = at_.model.terms().push.dot(wire.tangents[0]);
    report.base_torque = at_.model.terms().torque;
    report.largest_bend = largest_bend(wire, at_.model.directors);
    assert(report.contacts <= wire.segments() && report.largest_bend >= 0 && report.largest_bend < 3.15);
    assert(validate(wire).empty());
    // A wall that answers nonsense leaves no finite forces; the wire itself is finite.
    assert(wire.joints.back().allFinite());
    assert(report.termination != Termination::NotStarted && report.termination != Termination::Settled);
    end_ = wire;
    end_report_ = report;
}

}  // namespace physics
