#include "physics/relax/newton_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "physics/wire/bending.h"

namespace physics {
namespace {

Vec3 turned(const Vec3& director, const Vec3& axis, double angle) {
    return std::cos(angle) * director + std::sin(angle) * axis.cross(director);
}

/// Turn about the tangent `to` of a frame against the one that a smallest rotation from `from` makes of it.
double rolled(const Vec3& from, const Vec3& before, const Vec3& to, const Vec3& now) {
    const double k = 1 + from.dot(to);
    Vec3 carried = before;
    if (k > 1e-9) carried -= carried.dot(to) / k * (from + to);
    return std::atan2(carried.cross(now).dot(to), carried.dot(now));
}

}  // namespace

void NewtonModel::start(const Guidewire& wire, const ContactSet& contacts, int foreseen) {
    const std::size_t n = wire.segments();
    gains_.resize(n);
    turns_.resize(n + 1);
    trial_joints_.resize(n + 1);
    trial_tangents_.resize(n + 1);
    if (!wire.twists.empty()) {
        twist_gains_.resize(n);
        trial_twists_.resize(n + 1);
        trial_rolls_.resize(n + 1);
    }
    planes_.resize(n + 1);
    for (std::size_t j = foreseen + 1; j <= n; ++j) {
        const WallContact& c = contacts.contacts()[j];
        planes_[j] = {};
        if (c.touches())
            planes_[j].force =
                std::min(c.force(), wire.spring_constant(static_cast<int>(j) - 1) / wire.lengths[j]);
    }
}

RiccatiReport NewtonModel::linearise(const Guidewire& wire, const ContactSet& contacts, int first,
                                     double mu) {
    if (wire.bent_segments() > 0) transport_directors(wire, first, directors);
    mu_ = mu;
    if (!wire.twists.empty()) settled_ = directors;
    RiccatiReport report = assemble_and_solve(
        wire, contacts.contacts(), directors, first, mu, least_pivot, terms_, planes_,
        std::span(gains_).subspan(first - 1),
        wire.twists.empty() ? std::span<TwistGain>() : std::span(twist_gains_).subspan(first - 1));
    solve_turn(wire, mu, report);
    answers_ = certifies();
    return report;
}

RiccatiReport NewtonModel::certify(const Guidewire& wire, const ContactSet& contacts) {
    take_contacts(wire, contacts, 1, false);
    const int window = terms_.first;
    terms_.first = 1;
    set_axial_forces(wire);
    RiccatiReport report = riccati_backward(terms_.stages, 0, least_pivot, terms_.twists(), gains_,
                                            {terms_.twist_window(), window_twist_gains()});
    solve_turn(wire, 0, report);
    terms_.first = window;
    answers_ = true;
    return report;
}

void NewtonModel::take_contacts(const Guidewire& wire, const ContactSet& contacts, int first,
                                bool foreseen_forces) {
    for (int j = first; j < static_cast<int>(planes_.size()); ++j) {
        const WallContact& c = contacts.contacts()[j];
        const double force = foreseen_forces ? planes_[j].force : c.force();
        terms_.stages[j - 1].touches = false;
        if (c.touches() || force > 0) take_contact(c, j, Vec3::Zero(), force);
    }
    take_grips(wire, first);
}

void NewtonModel::take_grips(const Guidewire& wire, int first) {
    for (std::size_t j = first; j < wire.grips.size(); ++j) {
        if (!wire.grips[j].holds()) continue;
        if (!terms_.stages[j - 1].touches) planes_[j] = {};
        add_grip(wire.grips[j], wire.joints[j], terms_.stages[j - 1]);
    }
}

void NewtonModel::take_trial_contacts(const Guidewire& wire, const ContactSet& contacts) {
    foresee_forces(wire);
    for (RiccatiStage& s : terms_.window()) s.touches = false;
    for (std::size_t k = 0; k < contacts.asked().size(); ++k) {
        const WallContact& c = contacts.answers()[k];
        const int j = contacts.asked()[k];
        const double force = planes_[j].force;
        if (c.touches() || force > 0) take_contact(c, j, trial_joints_[j] - wire.joints[j], force);
    }
    take_grips(wire, terms_.first);
}

/// A contact's terms of second order about the place where the wall was asked, `moved` from the accepted
/// joint.
void NewtonModel::take_contact(const WallContact& c, int joint, const Vec3& moved, double force) {
    RiccatiStage& s = terms_.stages[joint - 1];
    ContactPlane& p = planes_[joint];
    p = {c.penetration - c.normal.dot(moved), c.stiffness, c.normal, force};
    s.touches = true;
    s.stiffness = c.stiffness * c.normal * c.normal.transpose() + force * c.curvature;
    s.force = c.stiffness * p.gap * c.normal - force * (c.curvature * moved) + c.stiffening_push();
}

void NewtonModel::solve(const Guidewire& wire, double mu) {
    answers_ = false;
    set_axial_forces(wire);
    RiccatiReport report = riccati_backward(terms_.window(), mu, least_pivot, terms_.twists(), window_gains(),
                                            {terms_.twist_window(), window_twist_gains()});
    solve_turn(wire, mu, report);
}

/// The turn of the tip's plane that the model's minimum asks for, against the spring of the shaft.
void NewtonModel::solve_turn(const Guidewire& wire, double mu, RiccatiReport& report) {
    turn_ = 0;
    device_turns_ = {};
    if (terms_.twist && !wire.devices.empty()) return answer_device_turns(wire, mu, report);
    if (terms_.windup_stiffness == 0) return;
    twist_twist_ = report.twist_twist + terms_.windup_stiffness;
    if (!(twist_twist_ > 0)) {
        if (report.shifted++ == 0) report.stage = -1;
        twist_twist_ = std::max(least_pivot, std::abs(twist_twist_));
    }
    answer_turn(wire, report.slope_twist, mu);
}

/// The turns of the devices' shapes that the model's minimum asks for, each against the spring of its shaft.
void NewtonModel::answer_device_turns(const Guidewire& wire, double mu, RiccatiReport& report) {
    const int count = static_cast<int>(wire.devices.size());
    // ψ turns every frame and ρ the second device alone: φ₀ = ψ, φ₁ = ψ + ρ.
    const double c = report.twist_twist, d = report.twist_second, e = report.second_second;
    Eigen::Matrix2d curve = Eigen::Matrix2d::Zero();
    Vec2 slope = Vec2::Zero();
    if (terms_.second) {
        curve << c - 2 * d + e, d - e, d - e, e;
        slope << report.slope_twist - report.slope_second, report.slope_second;
    } else {
        curve(0, 0) = c;
        slope[0] = report.slope_twist;
    }
    bool turns = false;
    for (int k = 0; k < 2; ++k) {
        const double stiffness = k < count && (k == 0 || terms_.second) ? terms_.device_stiffness[k] : 0.0;
        if (stiffness > 0) {
            turns = true;
            curve(k, k) += stiffness;
            slope[k] -= stiffness * wire.devices[k].windup;
        } else {  // stands still
            curve(k, 1 - k) = curve(1 - k, k) = 0;
            curve(k, k) = 1;
            slope[k] = 0;
        }
    }
    if (!turns) return;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
    solver.computeDirect(curve);
    Vec2 values = solver.eigenvalues();
    if (!(values[0] > 0)) {
        if (report.shifted++ == 0) report.stage = -1;
        values = values.cwiseAbs().cwiseMax(least_pivot);
    }
    double shaped = 0;
    for (const CoaxialDevice& device : wire.devices) shaped = std::max(shaped, shaped_length(device.spec));
    const double weight = mu * shaped * twist_arm * twist_arm;
    const Eigen::Matrix2d axes = solver.eigenvectors();
    Vec2 along = axes.transpose() * slope;
    for (int k = 0; k < 2; ++k) along[k] /= values[k] + weight;
    const Vec2 turn = -(axes * along);
    device_turns_ = {turn[0], turn[1]};
    device_way_ = axes.col(0);
}

void NewtonModel::turn_devices(Guidewire& wire) const {
    for (std::size_t k = 0; k < wire.devices.size(); ++k) {
        CoaxialDevice& device = wire.devices[k];
        if (device_turns_[k] == 0) continue;
        device.roll = std::remainder(device.roll + device_turns_[k], 2 * M_PI);
        device.windup -= device_turns_[k];
    }
}

void NewtonModel::answer_turn(const Guidewire& wire, double slope, double mu) {
    const double weight = mu * wire.spec.curved_length * twist_arm * twist_arm;
    if (terms_.windup_stiffness > 0)
        turn_ = (terms_.windup_stiffness * wire.windup - slope) / (twist_twist_ + weight);
}

void NewtonModel::set_axial_forces(const Guidewire& wire) {
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

void NewtonModel::answer(const Guidewire& wire, std::span<const FedStage> fed, double mu) {
    answers_ = mu == 0;
    answer_turn(wire,
                riccati_answer(terms_.stages, terms_.first - 1, mu, mu > 0, least_pivot, terms_.twists(),
                               gains_, fed),
                mu);
}

void NewtonModel::answer_again(const Guidewire& wire, std::span<const FedStage> fed) {
    answers_ = false;
    set_axial_forces(wire);
    answer_turn(
        wire,
        riccati_answer(terms_.stages, terms_.first - 1, 0, true, least_pivot, terms_.twists(), gains_, fed),
        0);
}

double NewtonModel::roll_out(const Guidewire& wire, double twist, std::span<const FedStage> fed) {
    const int n = wire.segments(), first = terms_.first;
    Vec3 x = wire.joints[first - 1];
    trial_joints_[first - 1] = x;
    trial_tangents_[first - 1] = wire.tangents[first - 1];
    turns_[first - 1].setZero();
    Vec2 prev = Vec2::Zero();
    double farthest = 0, slid = 0;
    // Sum of what must be finite: std::max drops a NaN, and an overflow makes a tangent zero.
    double sizes = 0;
    slope_ = 0;
    if (terms_.windup_stiffness > 0) {
        twist = turn_;
        slope_ = (terms_.base.torque - terms_.windup_stiffness * wire.windup) * turn_;
    }
    double second = 0;
    if (!wire.devices.empty()) {
        twist = device_turns_[0];
        second = device_turns_[1] - device_turns_[0];
        for (std::size_t k = 0; k < wire.devices.size(); ++k)
            slope_ += (terms_.device_torque(static_cast<int>(k)) -
                       terms_.device_stiffness[k] * wire.devices[k].windup) *
                      device_turns_[k];
    }
    for (int j = first; j <= n; ++j) {
        const RiccatiStage& s = terms_.stages[j - 1];
        const RiccatiGain& gain = gains_[j - 1];
        Vec2 alpha = gain.step;
        alpha.noalias() += gain.from_prev * prev;
        if (terms_.twist) alpha += gain.from_twist * twist;
        if (second != 0) alpha += gain.from_second * second;
        alpha.noalias() += gain.from_x * (x - wire.joints[j - 1]);
        if (terms_.twist) twist += s.twist_prev.dot(prev) + s.twist.dot(alpha);
        turns_[j] = prev = alpha;
        slope_ += terms_.gradient[j - 1].dot(alpha);
        Vec3 u = wire.tangents[j];
        u.noalias() += s.basis * alpha;
        const double square = u.squaredNorm();
        sizes += square;
        u *= 1 / std::sqrt(square);
        trial_tangents_[j] = u;
        double length = s.length;
        for (const FedStage& f : fed) {
            if (f.stage != j - 1) continue;
            const double by = f.by.dot(wire.tangents[j]);
            length += by, slid += by;
        }
        x += length * u;
        trial_joints_[j] = x;
        Vec3 moved = x - wire.joints[j];
        if (terms_.each) {
            const TwistGain& own = twist_gains_[j - 1];
            const double by =
                own.step + own.from_x.dot(moved) + own.from_turn.dot(alpha) + own.from_twist * twist;
            trial_twists_[j] = wire.twists[j] + by;
            twist += by;
            sizes += by;
            slope_ += terms_.twist_gradient[j - 1] * by;
        }
        if (slid != 0) moved -= slid * wire.tangents[j];
        farthest = std::max(farthest, moved.squaredNorm());
    }
    if (!std::isfinite(sizes + slope_ + farthest)) return std::numeric_limits<double>::infinity();
    return std::sqrt(farthest);
}

double NewtonModel::largest_turn() const {
    double turn = 0;
    for (std::size_t j = terms_.first; j < turns_.size(); ++j) turn = std::max(turn, turns_[j].squaredNorm());
    return std::sqrt(turn);
}

double NewtonModel::evaluate(Guidewire& wire, ContactSet& contacts) {
    const int first = terms_.first;
    double energy = contacts.evaluate(trial_joints_, first);
    if (!terms_.each) energy += grip_energy(wire.grips, trial_joints_, first);
    std::swap(wire.tangents, trial_tangents_);
    if (terms_.each) {
        std::copy(wire.twists.begin(), wire.twists.begin() + first, trial_twists_.begin());
        std::swap(wire.twists, trial_twists_);
    }
    for (std::size_t k = 0; k < wire.devices.size(); ++k)
        unturned_[k] = {wire.devices[k].roll, wire.devices[k].windup};
    turn_devices(wire);
    for (std::size_t k = 0; k < wire.devices.size(); ++k)
        energy += 0.5 * terms_.device_stiffness[k] * wire.devices[k].windup * wire.devices[k].windup;
    if (terms_.twist) {
        const Vec3 accepted = directors[first - 1];
        if (turn_ != 0) directors[first - 1] = turned(accepted, wire.tangents[first - 1], turn_);
        transport_directors(wire, first, directors);
        for (int j = first - 1; j < wire.segments(); ++j) energy += joint_energy(wire, directors, j);
        directors[first - 1] = accepted;
    } else {
        for (int j = first - 1; j < wire.segments(); ++j) energy += joint_energy(wire, directors, j);
    }
    for (std::size_t k = 0; k < wire.devices.size(); ++k)
        std::tie(wire.devices[k].roll, wire.devices[k].windup) = std::tie(unturned_[k][0], unturned_[k][1]);
    if (terms_.each) {
        energy += twist_energy(wire, wire.twists, first) + trial_grip_energy(wire);
        std::swap(wire.twists, trial_twists_);
    }
    std::swap(wire.tangents, trial_tangents_);
    if (terms_.windup_stiffness > 0) {
        const double left = wire.windup - turn_;
        energy += 0.5 * terms_.windup_stiffness * left * left;
    }
    return energy;
}

/// With the wire's tangents those of the trial state; sets the rolls.
double NewtonModel::trial_grip_energy(const Guidewire& wire) {
    if (wire.grips.empty()) return 0;
    double energy = 0;
    for (int j = terms_.first; j <= wire.segments(); ++j) {
        trial_rolls_[j] = rolled(trial_tangents_[j], settled_[j], wire.tangents[j], directors[j]);
        if (wire.grips[j].holds()) energy += wire.grips[j].energy(trial_joints_[j], trial_rolls_[j]);
    }
    return energy;
}

void NewtonModel::foresee_forces(const Guidewire& wire) {
    for (int j = terms_.first; j <= wire.segments(); ++j) {
        ContactPlane& p = planes_[j];
        if (!terms_.stages[j - 1].touches) {
            p.force = 0;
            continue;
        }
        const double depth = p.gap + p.normal.dot(trial_joints_[j] - wire.joints[j]);
        p.force = p.stiffness * std::max(0.0, depth);
    }
}

void NewtonModel::take(Guidewire& wire) {
    const int first = terms_.first;
    if (turn_ != 0) {
        for (int j = 0; j < first; ++j) directors[j] = turned(directors[j], wire.tangents[j], turn_);
        wire.roll = std::remainder(wire.roll + turn_, 2 * M_PI);
        wire.windup -= turn_;
    }
    turn_devices(wire);
    if (terms_.each) {
        std::copy(trial_twists_.begin() + first, trial_twists_.end(), wire.twists.begin() + first);
        for (std::size_t j = first; j < wire.grips.size(); ++j) wire.grips[j].roll += trial_rolls_[j];
    }
    std::copy(trial_tangents_.begin() + first, trial_tangents_.end(), wire.tangents.begin() + first);
    std::copy(trial_joints_.begin() + first, trial_joints_.end(), wire.joints.begin() + first);
}

void NewtonModel::turn_one(int stage, const Vec2& by) {
    for (RiccatiGain& gain : gains_) gain.step.setZero();
    for (TwistGain& gain : twist_gains_) gain.step = 0;
    turn_ = 0;
    device_turns_ = {};
    gains_[stage].step = by;
}

void NewtonModel::twist_one(int stage, double by) {
    turn_one(stage, Vec2::Zero());
    twist_gains_[stage].step = by;
}

void NewtonModel::unwind(const Guidewire& wire, double by) {
    for (RiccatiGain& gain : gains_) gain.step.setZero();
    if (wire.devices.empty())
        turn_ = by;
    else
        device_turns_ = {by * device_way_[0], by * device_way_[1]};
}

}  // namespace physics
