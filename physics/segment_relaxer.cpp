#include "physics/segment_relaxer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "physics/global_relaxer.h"

namespace physics {
namespace {

constexpr int kTries = 6;            // of an update that would raise the energy
constexpr double kTryAgain = 0.4;    // share of the last try
constexpr double kRest = 1e-10;      // largest turn in a sweep that counts as converged
constexpr double kRounding = 4e-16;  // of the energies that an update touches

/// Breaks perfect symmetry the same way every time: a bow of 1e-4 rad towards a fixed side. Its energy, about
/// 1e-9 C, is far below what a wire in need of it has to give.
void tilt(Guidewire& wire) {
    const int n = wire.segments();
    Vec3 side, other;
    tangent_basis(wire.tangents[0], side, other);
    side += 0.6 * other;
    for (int i = 1; i <= n; ++i)
        wire.tangents[i] = (wire.tangents[i] + 1e-4 * std::sin(M_PI * i / n) * side).normalized();
}

}  // namespace

SegmentRelaxer::SegmentRelaxer(const RelaxerConfig& config) : config_(config), schedule_(config.order) {
    if (config_.kind == RelaxerKind::FirstOrder) {  // Eq. 22: v = q̂
        config_.varied_segments = 1;
        config_.bending_curvature = config_.wall_curvature = config_.safeguard = false;
    }
    if (config_.kind == RelaxerKind::Konings) {
        config_.varied_segments = 1;
        config_.bending_curvature = config_.safeguard = false;
        schedule_ = Schedule(CycleOrder::Uniform);
    }
}

void SegmentRelaxer::refresh_tip(const Guidewire& wire, int first) {
    if (wire.curved_segments() == 0) return;
    transport_directors(wire, first, directors_);
    tip_torque(wire, directors_, torque_);
}

void SegmentRelaxer::begin(Guidewire& wire, ContactSet& contacts) {
    rebuild_joints(wire);
    contacts.reset(wire);
    directors_.resize(wire.joints.size());
    directors_[0] = rolled_director(wire);
    refresh_tip(wire, 1);
}

/// Algorithm 2: of the segments i+5…i+25, the one whose inclusion lowers the estimate of Eq. 37 most.
bool SegmentRelaxer::select_by_estimate(const Guidewire& wire, const ContactSet& contacts, int last,
                                        Vec3& turn) {
    const int from = varied_[count_ - 1];
    last = std::min(last, from + kLargestSeparation);
    if (last < from + kLeastSeparation) return false;
    double least = 0;
    int best = -1;
    Vec3 best_turn = Vec3::Zero();
    for (int j = from + kLeastSeparation; j <= last; ++j) {  // Algorithm 1
        const double lambda = wire.lengths[j];
        const PushSum sum = contacts.sum_from(j);
        const BendingTerms bending = bending_terms(wire, directors_, torque_, j);
        const Vec3 q = bending.pull - lambda * sum.force;
        const Vec3 e = q.normalized() - wire.tangents[j];
        const double energy = -q.dot(e) + 0.5 * e.dot(bending.curvature * e) +
                              lambda * e.dot(sum.stiffness * (0.5 * lambda * e + turn));
        if (best < 0 || energy < least) best = j, least = energy, best_turn = lambda * e;
    }
    varied_[count_++] = best;
    turn += best_turn;
    return true;
}

void SegmentRelaxer::choose_segments(const Guidewire& wire, const ContactSet& contacts, int segment) {
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
    if (last < segment + kLeastSeparation) return;
    const double lambda = wire.lengths[segment];
    const Vec3 q =
        bending_terms(wire, directors_, torque_, segment).pull - lambda * contacts.sum_from(segment).force;
    Vec3 turn =
        lambda * (q.normalized() - wire.tangents[segment]);  // Σ λε of the segments chosen so far [mm]
    while (count_ < config_.varied_segments && select_by_estimate(wire, contacts, last, turn)) {
    }
}

SegmentProblem SegmentRelaxer::local_problem(const Guidewire& wire, const ContactSet& contacts) const {
    SegmentProblem p;
    p.count = count_;
    std::array<PushSum, kMostVariedSegments> sum;
    for (int m = 0; m < count_; ++m) {
        const int i = varied_[m];
        const BendingTerms bending = bending_terms(wire, directors_, torque_, i);
        sum[m] = contacts.sum_from(i);
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
            if (m == n)
                p.curvature[m][m] += wall;
            else
                p.curvature[m][n] = p.curvature[n][m] = wall;
        }
    return p;
}

/// Turn the varied segments by `share` of the way to `target`. Where it must descend and does not, nothing
/// changes.
bool SegmentRelaxer::try_turn(Guidewire& wire, ContactSet& contacts, const Tangents& target, double share,
                              bool must_descend) {
    const int n = wire.segments(), first = varied_[0];
    const bool curved = wire.curved_segments() > 0;
    const int tip = curved ? std::max(0, n - wire.curved_segments()) : n;
    // Joints whose bending changes: both ends of each varied segment, and all of the curved tip, which every
    // turn proximal of it twists a little.
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
    const double push_before = must_descend ? contacts.energy(wire.joints, first) : 0.0;

    Tangents old;
    old_joints_.assign(wire.joints.begin() + first, wire.joints.end());
    if (curved) old_directors_.assign(directors_.begin() + first, directors_.end());
    for (int m = 0; m < count_; ++m) {
        Vec3& u = wire.tangents[varied_[m]];
        old[m] = u;
        u = limited_turn(u, target[m], share);
    }
    Vec3 shift = Vec3::Zero();
    for (int i = first, m = 0; i <= n; ++i) {
        if (m < count_ && varied_[m] == i) {
            shift += wire.lengths[i] * (wire.tangents[i] - old[m]);
            ++m;
        }
        wire.joints[i] += shift;
    }
    if (curved) transport_directors(wire, first, directors_);

    const double push_after = contacts.evaluate(wire.joints, first);
    if (must_descend) {
        const double bending_after = bending();
        const double change = (bending_after - bending_before) + (push_after - push_before);
        const double scale = bending_before + bending_after + std::abs(push_before) + std::abs(push_after) +
                             2 * contacts.load_scale(first);
        const double rounding = kRounding * scale;
        if (!(change <= rounding)) {
            for (int m = 0; m < count_; ++m) wire.tangents[varied_[m]] = old[m];
            std::copy(old_joints_.begin(), old_joints_.end(), wire.joints.begin() + first);
            if (curved) std::copy(old_directors_.begin(), old_directors_.end(), directors_.begin() + first);
            return false;
        }
    }
    contacts.commit();
    if (curved) tip_torque(wire, directors_, torque_);
    return true;
}

SegmentRelaxer::Tangents SegmentRelaxer::solve(const Guidewire& wire, const SegmentProblem& problem) const {
    if (config_.kind == RelaxerKind::Konings) {
        const int i = varied_[0];
        const double distal = i < wire.segments() ? wire.spring_constant(i) : 0.0;
        Tangents target;
        target.fill(small_turn_step(problem, wire.spring_constant(i - 1) + distal));
        return target;
    }
    return (config_.safeguard ? descending_step(problem) : plain_step(problem)).tangent;
}

double SegmentRelaxer::update(Guidewire& wire, ContactSet& contacts, int segment, RelaxReport& report) {
    choose_segments(wire, contacts, segment);
    const SegmentProblem problem = local_problem(wire, contacts);
    const Tangents target = solve(wire, problem);
    double share = 1;
    const int n = wire.segments();
    for (int m = 0; m < count_; ++m) {
        if (!target[m].allFinite()) return 0;
        const double limit = config_.turn_limit / std::sqrt(n + 1.0 - varied_[m]);
        share = std::min(share, largest_share(problem.tangent[m], target[m], limit));
    }
    bool moved = false;
    for (int attempt = 0; attempt < kTries && !moved; ++attempt, share *= kTryAgain)
        moved = try_turn(wire, contacts, target, share, config_.safeguard);
    if (!moved) {
        ++report.rejected;
        return 0;
    }
    double turn = 0;
    for (int m = 0; m < count_; ++m)
        turn = std::max(turn, (wire.tangents[varied_[m]] - problem.tangent[m]).norm());
    return turn;
}

RelaxReport SegmentRelaxer::relax(Guidewire& wire, const LumenWall& wall, const RelaxBudget& budget,
                                  const UpdateObserver& observer) {
    RelaxReport report;
    ContactSet contacts(wall);
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
            } else if (since_sweep_ < kRest) {
                report.converged = true;
                break;
            }
            since_sweep_ = turn.segment == 1 ? 0 : 1;  // only a sweep over the whole wire tells
            rebuild_joints(wire);
        }
        const double turned = update(wire, contacts, turn.segment, report);
        since_sweep_ = std::max(since_sweep_, turned);
        report.largest_turn = std::max(report.largest_turn, turned);
        if (observer) observer(turn.segment, wire);
    }
    rebuild_joints(wire);
    for (int i = 1; i <= wire.segments(); ++i) wire.stations[i] = contacts.contacts()[i].station;
    report.contacts = contacts.touching();
    report.wall_queries = contacts.queries();
    return report;
}

std::vector<std::string> problems(const RelaxerConfig& c) {
    std::vector<std::string> out;
    if (c.varied_segments < 1 || c.varied_segments > kMostVariedSegments)
        out.push_back("varied_segments must lie in 1 to 5, not " + std::to_string(c.varied_segments) + ".");
    if (c.kind == RelaxerKind::Geometric || c.kind == RelaxerKind::Combined)
        out.push_back("the geometrical relaxer is not in this version.");
    if (c.stored_planes && c.kind != RelaxerKind::Segment && c.kind != RelaxerKind::FirstOrder)
        out.push_back("stored_planes go with the segment and the first-order relaxer.");
    if (c.separation && (*c.separation < 2 || *c.separation > 200))
        out.push_back("separation must lie in 2 to 200, not " + std::to_string(*c.separation) + ".");
    if (!std::isfinite(c.turn_limit) || c.turn_limit <= 0 || c.turn_limit > 2)
        out.push_back("turn_limit must lie in (0, 2].");
    return out;
}

RelaxBudget whole_cycles(int segments, int cycles) {
    return {cycles * segments * (segments + 1) / 2, 0.0, 0};
}

std::unique_ptr<Relaxer> make_relaxer(const RelaxerConfig& config) {
    if (const auto wrong = problems(config); !wrong.empty()) throw std::invalid_argument(wrong.front());
    if (config.kind == RelaxerKind::Global) return std::make_unique<GlobalRelaxer>(config);
    return std::make_unique<SegmentRelaxer>(config);
}

}  // namespace physics
