#include "physics/relax/segment_relaxer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>

#include "physics/geometry/maths.h"
#include "physics/relax/geometric_step.h"
#include "physics/relax/stored_planes.h"

namespace physics {
namespace {

constexpr int tries = 6;                   // of an update that would raise the energy
constexpr double try_again = 0.4;          // fraction of the last try
constexpr double unit_rounding = 1e-9;     // of a tangent's length
constexpr double rest = 1e-10;             // largest turn in a sweep that counts as converged
constexpr double update_rounding = 4e-16;  // of the energies that an update touches

/// Breaks perfect symmetry the same way every time: a bow of 1e-4 rad towards a fixed side. Its energy, about
/// 1e-9 C, is far below what a wire that needs it releases.
void tilt(Chain& wire) {
    const int n = wire.segments();
    assert(n >= 1);
    Vec3 side, other;
    tangent_basis(wire.tangents[0], side, other);
    side += 0.6 * other;
    for (int i = 1; i <= n; ++i)
        wire.tangents[i] = (wire.tangents[i] + 1e-4 * geometry::sin(M_PI * i / n) * side).normalized();
}

}  // namespace

SegmentRelaxer::SegmentRelaxer(const RelaxerConfig& config, const LumenWall& wall)
    : config_(config), wall_(wall), schedule_(config.order) {
    if (config_.kind == RelaxerKind::FirstOrder) {  // Eq. 22: v = q̂
        config_.varied_segments = 1;
        config_.bending_curvature = config_.wall_curvature = config_.safeguard = false;
    }
    assert(config_.varied_segments >= 1 && config_.varied_segments <= most_varied_segments);
    if (config_.printed) config_.safeguard = false;
    if (config_.kind == RelaxerKind::Konings) {
        config_.varied_segments = 1;
        config_.bending_curvature = config_.safeguard = false;
        schedule_ = Schedule(CycleOrder::Uniform);
    }
}

void SegmentRelaxer::refresh_tip(const Chain& wire, int first) {
    if (wire.bent_segments() == 0) return;
    assert(first >= 1 && directors_.size() == wire.joints.size());
    transport_directors(wire, first, directors_);
    frame_torque(wire, directors_, torque_);
}

template <SweepContacts Contacts>
void SegmentRelaxer::begin(Chain& wire, Contacts& contacts) {
    rebuild_joints(wire);
    contacts.reset(wire);
    directors_.resize(wire.joints.size());
    directors_[0] = wire.base_director;
    refresh_tip(wire, 1);
    assert(contacts.contacts().size() == wire.joints.size());
}

/// Algorithm 2: of the segments i+5…i+25, the one whose inclusion lowers the estimate of Eq. 37 most.
template <SweepContacts Contacts>
bool SegmentRelaxer::select_by_estimate(const Chain& wire, const Contacts& contacts, int last, Vec3& turn) {
    assert(count_ >= 1 && count_ < most_varied_segments);
    const int from = varied_[count_ - 1];
    last = std::min(last, from + largest_separation);
    if (last < from + least_separation) return false;
    double least = 0;
    int best = -1;
    Vec3 best_turn = Vec3::Zero();
    for (int j = from + least_separation; j <= last; ++j) {  // Algorithm 1
        const double lambda = wire.lengths[j];
        const PushSum sum = contacts.sum_from(j);
        const BendingTerms bending = bending_terms(wire, directors_, torque_, j);
        const Vec3 q = bending.pull - lambda * sum.force;
        const Vec3 e = q.normalized() - wire.tangents[j];
        const double energy = -q.dot(e) + 0.5 * e.dot(bending.curvature * e) +
                              lambda * e.dot(sum.stiffness * (0.5 * lambda * e + turn));
        if (best < 0 || energy < least) best = j, least = energy, best_turn = lambda * e;
    }
    assert(best > from && best <= last);
    varied_[count_++] = best;
    turn += best_turn;
    return true;
}

template <SweepContacts Contacts>
void SegmentRelaxer::choose_segments(const Chain& wire, const Contacts& contacts, int segment) {
    assert(segment >= 1 && segment <= wire.segments());
    varied_[0] = segment;
    count_ = 1;
    const int last = contacts.last_touching();
    if (config_.varied_segments == 1 || last < segment) return;
    if (config_.separation) {
        const int delta = *config_.separation;
        while (count_ < config_.varied_segments && varied_[count_ - 1] + delta <= last) {
            varied_[count_] = varied_[count_ - 1] + delta;
            ++count_;
        }
        return;
    }
    if (last < segment + least_separation) return;
    const double lambda = wire.lengths[segment];
    const Vec3 q =
        bending_terms(wire, directors_, torque_, segment).pull - lambda * contacts.sum_from(segment).force;
    Vec3 turn =
        lambda * (q.normalized() - wire.tangents[segment]);  // Σ λε of the segments chosen so far [mm]
    while (count_ < config_.varied_segments && select_by_estimate(wire, contacts, last, turn)) {
    }
}

/// `beyond` is the push of joints that stay where they are however the varied segments turn.
template <SweepContacts Contacts>
SegmentProblem SegmentRelaxer::local_problem(const Chain& wire, const Contacts& contacts,
                                             const PushSum& beyond) const {
    assert(count_ >= 1 && varied_[count_ - 1] <= wire.segments());
    SegmentProblem p;
    p.count = count_;
    std::array<PushSum, most_varied_segments> sum;
    for (int m = 0; m < count_; ++m) {
        const int i = varied_[m];
        const BendingTerms bending = bending_terms(wire, directors_, torque_, i);
        assert(m == 0 || i > varied_[m - 1]);
        sum[m] = contacts.sum_from(i);
        sum[m].force -= beyond.force;
        sum[m].stiffness -= beyond.stiffness;
        p.tangent[m] = wire.tangents[i];
        p.pull[m] = bending.pull - wire.lengths[i] * sum[m].force;
        p.curvature[m][m].setZero();
        if (config_.bending_curvature) p.curvature[m][m] = bending.curvature;
    }
    for (int m = 0; m < count_; ++m)
        for (int n = m; n < count_; ++n) {  // P_mn = λ_m λ_n Σ_{l ≥ max} k n nᵀ, Eq. 30
            Mat3 wall = Mat3::Zero();
            if (config_.wall_curvature)
                wall = wire.lengths[varied_[m]] * wire.lengths[varied_[n]] * sum[n].stiffness;
            if (m == n) {
                p.curvature[m][m] += wall;
                continue;
            }
            if (varied_[n] == varied_[m] + 1) wall += neighbour_curvature(wire, varied_[m]);
            p.curvature[m][n] = wall;
            p.curvature[n][m] = wall.transpose();
        }
    return p;
}

/// Give the varied segments these tangents; joints past `last` stay. Where the energy must fall and does not,
/// nothing changes.
template <SweepContacts Contacts>
bool SegmentRelaxer::try_turn(Chain& wire, Contacts& contacts, const Tangents& target, int last,
                              bool must_descend) {
    const int n = wire.segments(), first = varied_[0];
    assert(count_ >= 1 && first >= 1 && last <= n);
    const bool curved = wire.bent_segments() > 0;
    const int tip = n - wire.bent_segments();
    // Joints whose bending changes: both ends of each varied segment, and all that is bent at rest, which
    // every turn proximal of it twists a little.
    auto bending = [&] {
        double sum = 0;
        int done = -1;
        for (int m = 0; m < count_; ++m)
            for (int j = std::max(done + 1, varied_[m] - 1); j <= std::min(varied_[m], tip - 1); ++j) {
                sum += joint_energy(wire, directors_, j);
                done = j;
            }
        for (int j = tip; j < n; ++j) sum += joint_energy(wire, directors_, j);
        return sum;
    };
    const double bending_before = must_descend ? bending() : 0.0;
    const double push_before = must_descend ? contacts.energy(wire, first, last) : 0.0;

    Tangents old;
    std::array<TailStep, most_varied_segments> steps;
    if (curved) old_directors_.assign(directors_.begin() + first, directors_.end());
    for (int m = 0; m < count_; ++m) {
        const int i = varied_[m];
        old[m] = wire.tangents[i];
        assert(std::abs(target[m].squaredNorm() - 1) < 2 * unit_rounding);
        wire.tangents[i] = target[m];
        steps[m] = {i, wire.lengths[i] * (target[m] - old[m])};
    }
    if (curved) transport_directors(wire, first, directors_);

    const double push_after = contacts.move(wire, {steps.data(), static_cast<std::size_t>(count_)}, last);
    if (must_descend) {
        const double bending_after = bending();
        const double change = (bending_after - bending_before) + (push_after - push_before);
        const double scale = bending_before + bending_after + std::abs(push_before) + std::abs(push_after) +
                             2 * contacts.load_scale(first);
        const double rounding = update_rounding * scale;
        if (!(change <= rounding)) {
            for (int m = 0; m < count_; ++m) wire.tangents[varied_[m]] = old[m];
            contacts.undo(wire);
            if (curved) std::copy(old_directors_.begin(), old_directors_.end(), directors_.begin() + first);
            return false;
        }
    }
    contacts.commit();
    if (curved) frame_torque(wire, directors_, torque_);
    return true;
}

SegmentRelaxer::Tangents SegmentRelaxer::solve(const Chain& wire, const SegmentProblem& problem) const {
    assert(problem.count == count_);
    if (config_.kind == RelaxerKind::Konings) {
        const int i = varied_[0];
        const double distal = i < wire.segments() ? wire.spring_constant(i) : 0.0;
        Tangents target;
        target.fill(small_turn_step(problem, wire.spring_constant(i - 1) + distal));
        return target;
    }
    if (config_.printed) return printed_step(problem).tangent;
    return (config_.safeguard ? descending_step(problem) : plain_step(problem)).tangent;
}

/// One update of the paper's method; the largest turn it made [-].
template <SweepContacts Contacts>
double SegmentRelaxer::turn_segments(Chain& wire, Contacts& contacts, int segment, RelaxReport& report) {
    choose_segments(wire, contacts, segment);
    const SegmentProblem problem = local_problem(wire, contacts, {});
    const Tangents target = solve(wire, problem);
    double fraction = 1;
    const int n = wire.segments();
    for (int m = 0; m < count_; ++m) {
        if (!(std::abs(target[m].squaredNorm() - 1) < unit_rounding)) {  // overflow makes NaN or zero
            ++report.rejected;
            return 0;
        }
        const double limit = config_.turn_limit / std::sqrt(n + 1.0 - varied_[m]);
        fraction = std::min(fraction, largest_fraction(problem.tangent[m], target[m], limit));
        assert(fraction >= 0 && fraction <= 1);
    }
    Tangents next;
    for (int attempt = 0; attempt < tries; ++attempt, fraction *= try_again) {
        for (int m = 0; m < count_; ++m) next[m] = limited_turn(problem.tangent[m], target[m], fraction);
        if (try_turn(wire, contacts, next, n, config_.safeguard)) return largest_turn(wire, problem);
    }
    ++report.rejected;
    return 0;
}

/// One update of the geometrical method: the piece of wire that begins with this segment.
template <SweepContacts Contacts>
double SegmentRelaxer::turn_piece(Chain& wire, Contacts& contacts, int segment, RelaxReport& report) {
    const int n = wire.segments();
    count_ = std::min(closed_segments, n - segment + 1);
    assert(count_ >= 1);
    const bool closed = count_ == closed_segments;
    std::array<double, closed_segments> lengths{};
    for (int m = 0; m < count_; ++m) {
        varied_[m] = segment + m;
        lengths[m] = wire.lengths[segment + m];
    }
    const int end = segment + count_ - 1;  // joint that a closed piece ends at
    const SegmentProblem problem = local_problem(wire, contacts, closed ? contacts.sum_from(end) : PushSum{});
    const GeometricStep step(problem, lengths, closed);
    double fraction = 1;
    for (int attempt = 0; attempt < tries; ++attempt, fraction *= try_again) {
        const auto next = step.turned(fraction, config_.turn_limit);
        if (next && try_turn(wire, contacts, *next, closed ? end - 1 : n, true))
            return largest_turn(wire, problem);
    }
    ++report.rejected;
    return 0;
}

double SegmentRelaxer::largest_turn(const Chain& wire, const SegmentProblem& before) const {
    double turn = 0;
    assert(before.count == count_);
    for (int m = 0; m < count_; ++m)
        turn = std::max(turn, (wire.tangents[varied_[m]] - before.tangent[m]).norm());
    assert(turn < 2 + 1e-9);
    return turn;
}

template <SweepContacts Contacts>
double SegmentRelaxer::update(Chain& wire, Contacts& contacts, int segment, RelaxReport& report) {
    assert(segment >= 1 && segment <= wire.segments());
    double turn = 0;
    if (config_.kind != RelaxerKind::Geometric) turn = turn_segments(wire, contacts, segment, report);
    if (config_.kind == RelaxerKind::Geometric || config_.kind == RelaxerKind::Combined)
        turn = std::max(turn, turn_piece(wire, contacts, segment, report));
    return turn;
}

template <SweepContacts Contacts>
RelaxReport SegmentRelaxer::sweep(Chain& wire, Contacts contacts, const RelaxBudget& budget,
                                  const UpdateObserver& observer) {
    RelaxReport report;
    report.termination = Termination::OutOfBudget;
    begin(wire, contacts);
    since_sweep_ = 1;
    bool tilted = false;
    for (; report.updates < budget.updates; ++report.updates) {
        const Schedule::Turn turn = schedule_.next(wire.segments(), budget);
        if (turn.starts_sweep) {
            // A wire pressed exactly along its axis is stationary without being at rest: tilt it once, a
            // little.
            if (since_sweep_ == 0 && contacts.touching() > 0 && !tilted) {
                tilt(wire);
                begin(wire, contacts);
                tilted = true;
            } else if (since_sweep_ < rest) {
                report.termination = Termination::Settled;
                break;
            }
            since_sweep_ = turn.segment == 1 ? 0 : 1;  // only a sweep over the whole wire decides
            contacts.start_sweep(wire, turn.segment);
        }
        contacts.settle(wire, turn.segment);
        const double turned = update(wire, contacts, turn.segment, report);
        since_sweep_ = std::max(since_sweep_, turned);
        report.largest_turn = std::max(report.largest_turn, turned);
        if (observer) observer(turn.segment, contacts.settled(wire));
    }
    contacts.settle_all(wire);
    rebuild_joints(wire);
    assert(contacts.contacts().size() == wire.joints.size());
    for (int i = 1; i <= wire.segments(); ++i) wire.stations[i] = contacts.contacts()[i].station;
    report.contacts = contacts.touching();
    report.wall_queries = contacts.queries();
    assert(report.updates <= std::max(0, budget.updates) && report.contacts <= wire.segments());
    assert(wire.tip().allFinite());
    return report;
}

RelaxReport SegmentRelaxer::relax(Chain& wire, const RelaxBudget& budget, const UpdateObserver& observer) {
    if (const std::string why = why_not(config_.kind, wire.devices); !why.empty())
        throw std::invalid_argument(why);
    if (config_.stored_planes) return sweep(wire, StoredPlanes(wall_), budget, observer);
    return sweep(wire, ContactSet(wall_), budget, observer);
}

}  // namespace physics
