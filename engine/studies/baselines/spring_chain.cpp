#include "engine/studies/baselines/spring_chain.h"

#include <algorithm>
#include <cmath>

namespace baselines {
namespace {

/// θ/sin θ of a joint with the cosine κ.
double angle_over_sine(double kappa) {
    const double c = std::clamp(kappa, -1.0 + 1e-9, 1.0), d = 1 - c;
    if (d < 1e-4) return 1 + d / 3 + 2 * d * d / 15;
    return std::acos(c) / std::sqrt(1 - c * c);
}

}  // namespace

void SpringChain::start(const std::vector<Vec3>& nodes) {
    take(nodes);
    for (auto* list : {&forces_, &old_forces_, &velocities_, &axes_})
        list->assign(nodes_.size(), Vec3::Zero());
    pressed_.assign(nodes_.size(), 0);
    kinetic_ = 0;
}

void SpringChain::find_forces() {
    const int n = segments();
    const double l = spec_.segment_length, spring = spec_.axial / l;
    std::fill(forces_.begin(), forces_.end(), Vec3::Zero());
    forces_[n] = spec_.load;
    Vec3 before = spec_.direction;
    double length_before = l;
    for (int i = 0; i < n; ++i) {
        const Vec3 link = nodes_[i + 1] - nodes_[i];
        const double length = link.norm();
        const Vec3 u = link / length;
        const Vec3 pull = spring * (length - l) * u;
        forces_[i] += pull;
        forces_[i + 1] -= pull;
        // The moment of joint i turns both its segments.
        const double kappa = before.dot(u), moment = joint_stiffness(i) * angle_over_sine(kappa);
        const Vec3 on_next = moment / length * (before - kappa * u);
        forces_[i + 1] += on_next;
        forces_[i] -= on_next;
        if (i > 0) {
            const Vec3 on_last = moment / length_before * (u - kappa * before);
            forces_[i] += on_last;
            forces_[i - 1] -= on_last;
        }
        axes_[i] = before + u;  // made a unit vector below
        before = u;
        length_before = length;
    }
    axes_[n] = before;
    for (int i = 1; i <= n; ++i) {
        axes_[i].normalize();
        pressed_[i] = 0;
        if (!tube_) continue;
        const Touch wall = touch(i, false);
        if (!(wall.depth > 0)) continue;
        pressed_[i] = 1;
        forces_[i] -= wall_stiffness(i) * wall.depth * wall.normal;
    }
}

Progress SpringChain::advance(int rounds) {
    if (diverged_) return Progress::Diverged;
    const int n = segments();
    const double l = spec_.segment_length;
    // Gershgorin's bound on the stiffness over four; a node is heavier along the wire than across.
    const double along = safety_ * spec_.axial / l;
    for (int round = 0; round < rounds; ++round) {
        std::swap(forces_, old_forces_);
        find_forces();
        double kinetic = 0, stiffness = 0, mass = 0, farthest = 0;
        const auto across_of = [&](int i) {
            const double bends = (i <= 2 ? 6 : 4) * spec_.bending / (l * l * l);
            // Two segments at an angle pull a little across the axis between them.
            return safety_ *
                   (bends + 0.25 * (pressed_[i] ? wall_stiffness(i) : 0.0) + 0.002 * spec_.axial / l);
        };
        double damping = 0;
        if (damping_ == Damping::Critical) {
            for (int i = 1; i <= n; ++i) {
                const double v = axes_[i].dot(velocities_[i]);
                stiffness += velocities_[i].dot(old_forces_[i] - forces_[i]);
                mass += across_of(i) * (velocities_[i].squaredNorm() - v * v) + along * v * v;
            }
            if (mass > 0 && stiffness > 0) damping = std::min(1.9, 2 * std::sqrt(stiffness / mass));
        }
        const double kept = (1 - 0.5 * damping) / (1 + 0.5 * damping), gained = 1 / (1 + 0.5 * damping);
        for (int i = 1; i <= n; ++i) {
            const double across = across_of(i), heavy = std::max(along, across);
            const Vec3& u = axes_[i];
            const double part = u.dot(forces_[i]);
            velocities_[i] =
                kept * velocities_[i] + gained * (forces_[i] / across + (1 / heavy - 1 / across) * part * u);
            const double v = u.dot(velocities_[i]);
            kinetic += across * (velocities_[i].squaredNorm() - v * v) + heavy * v * v;
            farthest = std::max(farthest, velocities_[i].cwiseAbs().maxCoeff());
        }
        ++tally_.rounds;
        if (!std::isfinite(kinetic)) {
            diverged_ = true;
            return Progress::Diverged;
        }
        if (damping_ == Damping::Kinetic && kinetic < kinetic_) {
            for (Vec3& v : velocities_) v.setZero();
            kinetic = 0;
        }
        kinetic_ = kinetic;
        for (int i = 1; i <= n; ++i) nodes_[i] += velocities_[i];
        if (lost()) {
            diverged_ = true;
            return Progress::Diverged;
        }
        if (rests(farthest, 1e-13)) return Progress::AtRest;
    }
    return Progress::Going;
}

double SpringChain::energy() const {
    double energy = wall_energy();
    const double l = spec_.segment_length;
    Vec3 before = spec_.direction;
    for (int i = 0; i < segments(); ++i) {
        const Vec3 link = nodes_[i + 1] - nodes_[i];
        const double length = link.norm();
        const Vec3 u = link / length;
        const double angle = 2 * std::asin(std::min(1.0, 0.5 * (u - before).norm()));
        energy += 0.5 * joint_stiffness(i) * angle * angle;
        energy += 0.5 * spec_.axial / l * (length - l) * (length - l);
        before = u;
    }
    return energy;
}

}  // namespace baselines
