#include "physics/relax/newton_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <tuple>

#include "physics/geometry/maths.h"
#include "physics/relax/riccati_recursion.h"
#include "physics/wire/bending.h"

namespace physics {
namespace {

/// Turn about the tangent `to` of a frame against the one that a smallest rotation from `from` makes of it.
double rolled(const Vec3& from, const Vec3& before, const Vec3& to, const Vec3& now) {
    assert(std::abs(from.squaredNorm() - 1) < 1e-9 && std::abs(to.squaredNorm() - 1) < 1e-9);
    const double k = 1 + from.dot(to);
    Vec3 carried = before;
    if (k > 1e-9) carried -= carried.dot(to) / k * (from + to);
    return geometry::atan2(carried.cross(now).dot(to), carried.dot(now));
}

}  // namespace

void NewtonModel::size_for(const Chain& wire) {
    const std::size_t n = wire.segments();
    gains_.resize(n);
    trial_.turns.resize(n + 1);
    trial_.joints.resize(n + 1);
    trial_.tangents.resize(n + 1);
    for (std::size_t k = 0; k < wire.devices.size(); ++k)
        trial_.wound[k].resize(wire.devices[k].twists_by_segments() ? n + 1 : 0);
    trial_.rolls.resize(n + 1);
    planes_.resize(n + 1);
}

void NewtonModel::start_with(const Chain& wire, std::span<const double> forces) {
    assert(forces.size() == wire.joints.size());
    size_for(wire);
    for (std::size_t j = 0; j < planes_.size(); ++j) {
        planes_[j] = {};
        planes_[j].force = forces[j];
    }
}

void NewtonModel::start(const Chain& wire, const ContactSet& contacts, int foreseen) {
    assert(foreseen >= 0 && contacts.contacts().size() == wire.joints.size());
    size_for(wire);
    const std::size_t n = wire.segments();
    for (std::size_t j = foreseen + 1; j <= n; ++j) {
        const WallContact& c = contacts.contacts()[j];
        planes_[j] = {};
        if (c.touches())
            planes_[j].force =
                std::min(c.force(), wire.spring_constant(static_cast<int>(j) - 1) / wire.lengths[j]);
    }
}

RiccatiReport NewtonModel::linearise(const Chain& wire, const ContactSet& contacts, int first, double mu) {
    assert(first >= 1 && first <= wire.segments() && mu >= 0);
    if (wire.bent_segments() > 0) transport_directors(wire, first, directors);
    mu_ = mu;
    RiccatiReport report = assemble_and_solve(wire, contacts.contacts(), directors, first, mu, least_pivot,
                                              terms_, planes_, gains_, frame_gains_);
    if (terms_.frames.each) settled_ = directors;
    turn_base(wire, mu, report);
    answers_ = certifies();
    return report;
}

RiccatiReport NewtonModel::certify(const Chain& wire, const ContactSet& contacts) {
    assert(stages() == wire.segments());
    take_contacts(wire, contacts, 1, false);
    const int window = terms_.first;
    terms_.first = 1;
    set_axial_forces(wire);
    RiccatiReport report =
        riccati_backward(terms_.stages, 0, least_pivot, gains_, terms_.framed(1, frame_gains_));
    turn_base(wire, 0, report);
    terms_.first = window;
    answers_ = true;
    return report;
}

void NewtonModel::take_contacts(const Chain& wire, const ContactSet& contacts, int first,
                                bool predicted_contact_forces) {
    assert(first >= 1 && planes_.size() == wire.joints.size() && stages() == wire.segments());
    for (int j = first; j < static_cast<int>(planes_.size()); ++j) {
        const WallContact& c = contacts.contacts()[j];
        const double force = predicted_contact_forces ? planes_[j].force : c.force();
        terms_.stages[j - 1].touches = false;
        if (c.touches() || force > 0) take_contact(c, j, Vec3::Zero(), force);
    }
    take_grips(wire, first, [&](int j) { return GripTerms(wire.grips[j], wire.joints[j]); });
}

template <class Terms>
void NewtonModel::take_grips(const Chain& wire, int first, const Terms& terms_of) {
    assert(first >= 1 && planes_.size() == wire.joints.size());
    double place = 0;  // counts where devices twist by segments alone
    for (int j = 1; j < static_cast<int>(wire.grips.size()); ++j) {
        place += wire.lengths[j];
        if (j < first || !wire.grips[j].holds()) continue;
        if (!terms_.stages[j - 1].touches) planes_[j] = {};
        const GripTerms terms = terms_of(j);
        add_grip(terms, terms_.stages[j - 1]);
        if (terms_.frames.each) set_held_twist(wire, j, place, terms, terms_);
    }
}

void NewtonModel::take_trial_contacts(const Chain& wire, const ContactSet& contacts) {
    assert(contacts.asked().size() == contacts.answers().size() &&
           trial_.joints.size() == wire.joints.size());
    predict_contact_forces(wire);
    for (RiccatiStage& s : terms_.window()) s.touches = false;
    for (std::size_t k = 0; k < contacts.asked().size(); ++k) {
        const WallContact& c = contacts.answers()[k];
        const int j = contacts.asked()[k];
        const double force = planes_[j].force;
        if (c.touches() || force > 0) take_contact(c, j, trial_.joints[j] - wire.joints[j], force);
    }
    take_grips(wire, terms_.first, [&](int j) { return trial_grip(wire.grips[j], wire.joints[j], j); });
}

/// A grip's terms for a trial: where that has turned it back, those of the steepest paraboloid about its
/// anchor that touches its potential at the trial state from above.
GripTerms NewtonModel::trial_grip(const Grip& grip, const Vec3& joint, int j) const {
    const Vec3 from = grip.stretch(joint),
               to = grip.stretch(trial_.joints[j], terms_.frames.each ? trial_.rolls[j] : 0.0);
    const double a = from.norm(), b = to.norm();
    if ((a <= slip_length && b <= slip_length) || (a > slip_length && from.dot(to) > slips_on * a * a))
        return {grip, joint};
    const double weight = grip.force / std::max(slip_length, b);
    assert(weight > 0 || !std::isfinite(b));
    GripTerms terms;
    terms.drag = weight * from;
    terms.stiffness = weight * (Mat3::Identity() - grip.normal * grip.normal.transpose());
    return terms;
}

/// A contact's terms of second order about the place where the wall was asked, `moved` from the accepted
/// joint.
void NewtonModel::take_contact(const WallContact& c, int joint, const Vec3& moved, double force) {
    assert(joint >= 1 && joint <= stages());
    RiccatiStage& s = terms_.stages[joint - 1];
    ContactPlane& p = planes_[joint];
    p = {c.penetration - c.normal.dot(moved), c.stiffness, c.normal, force};
    s.touches = true;
    s.stiffness = c.stiffness * c.normal * c.normal.transpose() + force * c.curvature;
    s.force = c.stiffness * p.gap * c.normal - force * (c.curvature * moved) + c.stiffening_push();
}

void NewtonModel::solve(const Chain& wire, double mu) {
    assert(mu >= 0 && stages() == wire.segments());
    answers_ = false;
    set_axial_forces(wire);
    RiccatiReport report = riccati_backward(terms_.window(), mu, least_pivot, window_gains(),
                                            terms_.framed(terms_.first, frame_gains_));
    turn_base(wire, mu, report);
}

/// The turns of the frames at the base that the model's minimum asks for.
void NewtonModel::turn_base(const Chain& wire, double mu, RiccatiReport& report) {
    base_curve_ = report.curve;
    solve_base(wire, with_springs(wire, report.slope), mu, &report);
}

/// The slopes by the frames' turns at the base, with the springs of shafts that wind up as a whole.
FrameVector NewtonModel::with_springs(const Chain& wire, FrameVector slopes) const {
    for (int f = 0; f < terms_.frames.count; ++f) {
        const Device& device = wire.devices[terms_.frames.device[f]];
        slopes[f] -= device.windup_stiffness * device.windup;
    }
    return slopes;
}

/// The same for these slopes, with springs: each shaft that winds up as a whole; the others stand still.
void NewtonModel::solve_base(const Chain& wire, const FrameVector& slopes, double mu, RiccatiReport* report) {
    trial_.turns_at_base = {};
    std::array<int, most_devices> free = {};
    int count = 0;
    for (int f = 0; f < terms_.frames.count; ++f)
        if (wire.devices[terms_.frames.device[f]].windup_stiffness > 0) free[count++] = f;
    if (count == 0) return;
    using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_devices, most_devices>;
    using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_devices, 1>;
    Matrix curve(count, count);
    Vector slope(count);
    double shaped = 0;
    for (int a = 0; a < count; ++a) {
        const Device& device = wire.devices[terms_.frames.device[free[a]]];
        for (int b = 0; b < count; ++b) curve(a, b) = base_curve_[free[a]][free[b]];
        curve(a, a) += device.windup_stiffness;
        slope[a] = slopes[free[a]];
        shaped = std::max(shaped, shaped_length(device.spec));
    }
    const double weight = mu * shaped * twist_arm * twist_arm;
    Vector turn, direction = Vector::Ones(count);
    if (count == 1) {
        double pivot = curve(0, 0);
        if (!(pivot > 0)) {
            if (report && report->shifted++ == 0) report->stage = -1, report->frame = free[0];
            pivot = std::max(least_pivot, std::abs(pivot));
        }
        assert(pivot > 0);
        turn = -slope / (pivot + weight);
    } else {
        const Eigen::SelfAdjointEigenSolver<Matrix> solver(curve);
        Vector values = solver.eigenvalues();
        if (!(values[0] > 0)) {
            if (report && report->shifted++ == 0) report->stage = -1, report->frame = free[0];
            values = values.cwiseAbs().cwiseMax(least_pivot);
        }
        const Matrix axes = solver.eigenvectors();
        Vector along = axes.transpose() * slope;
        for (int k = 0; k < count; ++k) along[k] /= values[k] + weight;
        turn = -(axes * along);
        direction = axes.col(0);
    }
    base_direction_ = {};
    for (int a = 0; a < count; ++a)
        trial_.turns_at_base[free[a]] = turn[a], base_direction_[free[a]] = direction[a];
}

void NewtonModel::turn_devices(Chain& wire) const {
    for (int f = 0; f < terms_.frames.count; ++f) {
        if (trial_.turns_at_base[f] == 0) continue;
        Device& device = wire.devices[terms_.frames.device[f]];
        assert(device.windup_stiffness > 0);  // the others stand still
        device.roll += trial_.turns_at_base[f];
        device.windup -= trial_.turns_at_base[f];
    }
}

void NewtonModel::set_axial_forces(const Chain& wire) {
    assert(stages() == wire.segments());
    const bool loaded = !wire.load.isZero(0), gripped = !wire.grips.empty();
    Vec3 force = Vec3::Zero();
    for (int j = wire.segments(); j >= terms_.first; --j) {
        RiccatiStage& s = terms_.stages[j - 1];
        if (s.touches) force += planes_[j].force * planes_[j].normal;
        if (gripped && wire.grips[j].holds()) force += wire.grips[j].push(wire.joints[j]);
        if (loaded) force -= wire.length_of(j) * wire.load;
        s.axial = s.length * wire.tangents[j].dot(force);
    }
}

void NewtonModel::answer(const Chain& wire, std::span<const FedStage> fed, double mu) {
    assert(answers_ && mu >= 0);
    answers_ = mu == 0;
    const FrameVector slopes = riccati_answer(terms_.stages, terms_.first - 1, mu, mu > 0, least_pivot,
                                              gains_, terms_.framed(1, frame_gains_), fed);
    solve_base(wire, with_springs(wire, slopes), mu, nullptr);
}

void NewtonModel::answer_again(const Chain& wire, std::span<const FedStage> fed) {
    assert(stages() == wire.segments() && terms_.first >= 1);
    answers_ = false;
    set_axial_forces(wire);
    const FrameVector slopes = riccati_answer(terms_.stages, terms_.first - 1, 0, true, least_pivot, gains_,
                                              terms_.framed(1, frame_gains_), fed);
    solve_base(wire, with_springs(wire, slopes), 0, nullptr);
}

double NewtonModel::roll_out(const Chain& wire, std::span<const FedStage> fed) {
    return with_frames(terms_.frames.count, [&](auto count) { return roll_out<count()>(wire, fed); });
}

/// Gives segment j's frames their own twists, which add up to `wound` from the window's base. Returns
/// Σ|twist|.
template <int F>
double NewtonModel::twist_out(const Chain& wire, int j, const Vec3& moved, const Vec2& alpha,
                              FrameVector& twist, FrameVector& wound) {
    assert(terms_.frames.each && j >= terms_.first);
    double sizes = 0;
    // Those that were eliminated last come first.
    for (int f = F - 1; f >= 0; --f) {
        if (terms_.frame_stages[(j - 1) * F + f].twist_stiffness == 0) continue;
        const FrameGain& own = frame_gains_[(j - 1) * F + f];
        double by = own.step + own.from_x.dot(moved) + own.from_turn.dot(alpha);
        for (int g = 0; g < F; ++g) by += own.from_frame[g] * twist[g];
        twist[f] += by;
        wound[f] += by;
        sizes += std::abs(by);
        trial_.slope += terms_.frame_gradient[(j - 1) * F + f] * by;
        const int device = terms_.frames.device[f];
        trial_.wound[device][j] = wire.devices[device].wound[j] + wound[f];
    }
    return sizes;
}

template <int F>
double NewtonModel::roll_out(const Chain& wire, std::span<const FedStage> fed) {
    const int n = wire.segments(), first = terms_.first;
    Vec3 x = wire.joints[first - 1];
    assert(trial_.joints.size() == wire.joints.size() && gains_.size() == terms_.stages.size());
    assert(frame_gains_.size() == gains_.size() * F && terms_.frames.count == F);
    trial_.joints[first - 1] = x;
    trial_.tangents[first - 1] = wire.tangents[first - 1];
    trial_.turns[first - 1].setZero();
    Vec2 prev = Vec2::Zero();
    double farthest = 0, slid = 0;
    // Sum of what must be finite: std::max drops a NaN, and an overflow makes a tangent zero.
    double sizes = 0;
    trial_.slope = 0;
    [[maybe_unused]] FrameVector twist = trial_.turns_at_base;
    for (int f = 0; f < F; ++f) {
        const Device& device = wire.devices[terms_.frames.device[f]];
        trial_.slope += (terms_.base.torque[f] - device.windup_stiffness * device.windup) * twist[f];
        if (device.twists_by_segments())
            trial_.wound[terms_.frames.device[f]][first - 1] = device.wound[first - 1];
    }
    [[maybe_unused]] FrameVector wound = {};  // own twists added so far, from the window's base
    for (int j = first; j <= n; ++j) {
        const RiccatiStage& s = terms_.stages[j - 1];
        const RiccatiGain& gain = gains_[j - 1];
        Vec2 alpha = gain.step;
        alpha.noalias() += gain.from_prev * prev;
        for (int f = 0; f < F; ++f) alpha += frame_gains_[(j - 1) * F + f].turn * twist[f];
        alpha.noalias() += gain.from_x * (x - wire.joints[j - 1]);
        if constexpr (F > 0) {
            const double by = s.twist_prev.dot(prev) + s.twist.dot(alpha);
            for (int f = 0; f < F; ++f) twist[f] += by;
        }
        trial_.turns[j] = prev = alpha;
        trial_.slope += terms_.gradient[j - 1].dot(alpha);
        Vec3 u = wire.tangents[j];
        u.noalias() += s.basis * alpha;
        const double square = u.squaredNorm();
        sizes += square;
        u *= 1 / std::sqrt(square);
        trial_.tangents[j] = u;
        double length = s.length;
        for (const FedStage& f : fed) {
            if (f.stage != j - 1) continue;
            const double by = f.by.dot(wire.tangents[j]);
            length += by, slid += by;
        }
        x += length * u;
        trial_.joints[j] = x;
        Vec3 moved = x - wire.joints[j];
        if (F > 0 && terms_.frames.each) sizes += twist_out<F>(wire, j, moved, alpha, twist, wound);
        if (slid != 0) moved -= slid * wire.tangents[j];
        farthest = std::max(farthest, moved.squaredNorm());
    }
    if (!std::isfinite(sizes + trial_.slope + farthest)) return std::numeric_limits<double>::infinity();
    assert(std::abs(trial_.tangents[n].squaredNorm() - 1) < 1e-9);
    return std::sqrt(farthest);
}

double NewtonModel::largest_turn() const {
    assert(trial_.turns.size() == terms_.stages.size() + 1);
    double turn = 0;
    for (std::size_t j = terms_.first; j < trial_.turns.size(); ++j)
        turn = std::max(turn, trial_.turns[j].squaredNorm());
    return std::sqrt(turn);
}

double NewtonModel::evaluate(Chain& wire, ContactSet& contacts) {
    assert(trial_.joints.size() == wire.joints.size());
    const int first = terms_.first, n = wire.segments();
    double energy = contacts.evaluate(trial_.joints, first);
    if (!terms_.frames.each) energy += grip_energy(wire.grips, trial_.joints, first);
    std::swap(wire.tangents, trial_.tangents);
    const auto swap_wound = [&] {
        for (std::size_t k = 0; k < wire.devices.size(); ++k)
            if (wire.devices[k].twists_by_segments()) std::swap(wire.devices[k].wound, trial_.wound[k]);
    };
    if (terms_.frames.each) {
        for (std::size_t k = 0; k < wire.devices.size(); ++k)
            if (wire.devices[k].twists_by_segments())
                std::copy(wire.devices[k].wound.begin(), wire.devices[k].wound.begin() + first,
                          trial_.wound[k].begin());
        swap_wound();
    }
    std::array<std::pair<double, double>, most_devices> unturned;
    for (std::size_t k = 0; k < wire.devices.size(); ++k)
        unturned[k] = {wire.devices[k].roll, wire.devices[k].windup};
    turn_devices(wire);
    if (wire.bent_segments() > 0) transport_directors(wire, first, directors);
    for (int j = first - 1; j < n; ++j) energy += joint_energy(wire, directors, j);
    energy += coupling_energy(wire, first - 1) + twist_energy(wire, first);
    for (std::size_t k = 0; k < wire.devices.size(); ++k)
        std::tie(wire.devices[k].roll, wire.devices[k].windup) = unturned[k];
    if (terms_.frames.each) {
        swap_wound();
        energy += trial_grip_energy(wire);
    }
    std::swap(wire.tangents, trial_.tangents);
    return energy;
}

/// Sets the rolls; the directors are those of the trial state.
double NewtonModel::trial_grip_energy(const Chain& wire) {
    assert(settled_.size() == directors.size());
    if (wire.grips.empty()) return 0;
    double energy = 0, place = 0;
    for (int j = 1; j <= wire.segments(); ++j) {
        place += wire.lengths[j];
        if (j < terms_.first) continue;
        const int owner = wire.outermost(place);
        const Device& device = wire.devices[owner];
        // A surface whose roll the model does not know is not held by it. evaluate() has swapped the
        // tangents: the chain's are the trial's.
        trial_.rolls[j] = !device.twists_by_segments()
                              ? 0
                              : rolled(trial_.tangents[j], settled_[j], wire.tangents[j], directors[j]) +
                                    trial_.wound[owner][j] - device.wound[j];
        if (wire.grips[j].holds()) energy += wire.grips[j].energy(trial_.joints[j], trial_.rolls[j]);
    }
    return energy;
}

void NewtonModel::predict_contact_forces(const Chain& wire) {
    assert(planes_.size() == wire.joints.size());
    for (int j = terms_.first; j <= wire.segments(); ++j) {
        ContactPlane& p = planes_[j];
        if (!terms_.stages[j - 1].touches) {
            p.force = 0;
            continue;
        }
        const double depth = p.gap + p.normal.dot(trial_.joints[j] - wire.joints[j]);
        p.force = p.stiffness * std::max(0.0, depth);
    }
}

void NewtonModel::take(Chain& wire) {
    assert(trial_.joints.size() == wire.joints.size());
    const int first = terms_.first;
    turn_devices(wire);
    for (Device& device : wire.devices) device.roll = std::remainder(device.roll, 2 * M_PI);
    if (terms_.frames.each) {
        for (std::size_t k = 0; k < wire.devices.size(); ++k)
            if (wire.devices[k].twists_by_segments())
                std::copy(trial_.wound[k].begin() + first, trial_.wound[k].end(),
                          wire.devices[k].wound.begin() + first);
        for (std::size_t j = first; j < wire.grips.size(); ++j) wire.grips[j].roll += trial_.rolls[j];
    }
    std::copy(trial_.tangents.begin() + first, trial_.tangents.end(), wire.tangents.begin() + first);
    std::copy(trial_.joints.begin() + first, trial_.joints.end(), wire.joints.begin() + first);
}

void NewtonModel::turn_one(int stage, const Vec2& by) {
    assert(stage >= 0 && stage < stages());
    unwind(0);
    gains_[stage].step = by;
}

void NewtonModel::twist_one(int stage, int frame, double by) {
    assert(stage >= 0 && stage < stages() && frame >= 0 && frame < terms_.frames.count);
    unwind(0);
    frame_gains_[stage * terms_.frames.count + frame].step = by;
}

void NewtonModel::unwind(double by) {
    assert(std::isfinite(by));
    for (RiccatiGain& gain : gains_) gain.step.setZero();
    for (FrameGain& gain : frame_gains_) gain.step = 0;
    for (int f = 0; f < most_devices; ++f) trial_.turns_at_base[f] = by * base_direction_[f];
}

void NewtonModel::size_twists(std::size_t joints) {
    assert(joints == planes_.size());
    trial_.rolls.resize(joints);
    for (int f = 0; f < terms_.frames.count; ++f)
        trial_.wound[terms_.frames.device[f]].resize(terms_.frames.each ? joints : 0);
}

}  // namespace physics
