#include "engine/studies/baselines/position_rod.h"

#include <algorithm>
#include <cmath>

namespace baselines {

// Inverse masses are 1 and those of x_0 and of the node before it, which the clamp stands for, are 0. A
// constraint of compliance a then has a/step beside its |∇|².

void PositionRod::start(const std::vector<Vec3>& nodes) {
    take(nodes);
    step_.assign(nodes_.size(), Vec3::Zero());
    bends_.assign(nodes_.size(), Vec3::Zero());
    stretches_.assign(nodes_.size(), 0.0);
    presses_.assign(nodes_.size(), 0.0);
    touches_.assign(nodes_.size(), Touch{});
}

void PositionRod::keep_length(int i) {
    const Vec3 link = nodes_[i] - nodes_[i - 1];
    const double length = link.norm();
    if (!(length > 0)) return;
    const double weight = i > 1 ? 2 : 1, change = (spec_.segment_length - length) / weight;
    stretches_[i] += change;
    const Vec3 move = (change / length) * link;
    nodes_[i] += move;
    if (i > 1) nodes_[i - 1] -= move;
    ++tally_.solves;
}

void PositionRod::bend(int i) {
    // C = (x_{i+1} − 2x_i + x_{i−1})/λ; at the clamp (x_1 − x_0)/λ − u_0.
    const double l = spec_.segment_length, soft = 1 / (joint_stiffness(i) * settings_.step);
    ++tally_.solves;
    if (i == 0) {
        const Vec3 c = (nodes_[1] - nodes_[0]) / l - spec_.direction;
        const Vec3 change = -(c + soft * bends_[0]) / (1 / (l * l) + soft);
        bends_[0] += change;
        nodes_[1] += change / l;
        return;
    }
    const Vec3 c = (nodes_[i + 1] - 2 * nodes_[i] + nodes_[i - 1]) / l;
    const double weight = ((i > 1 ? 1 : 0) + 5) / (l * l);
    const Vec3 change = -(c + soft * bends_[i]) / (weight + soft);
    bends_[i] += change;
    nodes_[i + 1] += change / l;
    nodes_[i] -= 2 / l * change;
    if (i > 1) nodes_[i - 1] += change / l;
}

void PositionRod::press(int i) {
    // −λ/k = depth where λ ≤ 0 holds the node in.
    touches_[i] = touch(i, false);
    if (touches_[i].depth <= 0 && presses_[i] == 0) return;
    const double soft = 1 / (wall_stiffness(i) * settings_.step);
    const double wanted = presses_[i] - (touches_[i].depth + soft * presses_[i]) / (1 + soft);
    const double change = std::min(0.0, wanted) - presses_[i];
    presses_[i] += change;
    nodes_[i] += change * touches_[i].normal;
    ++tally_.solves;
}

void PositionRod::apply_multipliers() {
    const int n = segments();
    const double l = spec_.segment_length;
    moves_.assign(nodes_.size(), Vec3::Zero());
    for (int i = 1; i <= n; ++i) {
        const Vec3 pull = stretches_[i] * (nodes_[i] - nodes_[i - 1]).normalized();
        moves_[i] += pull;
        moves_[i - 1] -= pull;
        moves_[i] += bends_[i - 1] / l;
        if (i > 1) {
            moves_[i - 1] -= 2 / l * bends_[i - 1];
            moves_[i - 2] += bends_[i - 1] / l;
        }
        if (presses_[i] != 0) moves_[i] += presses_[i] * touches_[i].normal;
    }
    for (int i = 1; i <= n; ++i) nodes_[i] += moves_[i];
}

Progress PositionRod::advance(int rounds) {
    if (diverged_) return Progress::Diverged;
    const int n = segments();
    std::vector<Vec3> old;
    for (int round = 0; round < rounds; ++round) {
        old = nodes_;
        if (settings_.momentum)
            for (int i = 1; i <= n; ++i) nodes_[i] += step_[i];
        nodes_[n] += settings_.step * spec_.load;
        if (settings_.warm_start) {
            apply_multipliers();
        } else {
            std::fill(bends_.begin(), bends_.end(), Vec3::Zero());
            std::fill(stretches_.begin(), stretches_.end(), 0.0);
            std::fill(presses_.begin(), presses_.end(), 0.0);
        }
        for (int k = 0; k < settings_.iterations; ++k) {
            const bool forwards = (tally_.rounds + k) % 2 == 0;
            for (int j = 1; j <= n; ++j) {
                const int i = forwards ? j : n + 1 - j;
                bend(i - 1);
                if (tube_) press(i);
                keep_length(i);
            }
        }
        ++tally_.rounds;
        double turned = 0, farthest = 0;
        for (int i = 1; i <= n; ++i) {
            const Vec3 moved = nodes_[i] - old[i];
            turned += moved.dot(step_[i]);
            farthest = std::max(farthest, moved.cwiseAbs().maxCoeff());
            step_[i] = moved;
        }
        if (!std::isfinite(turned) || lost()) {
            nodes_ = old;
            diverged_ = true;
            return Progress::Diverged;
        }
        // Velocities are dropped when the rod turns back, so that it does not swing for ever.
        if (turned < 0) std::fill(step_.begin(), step_.end(), Vec3::Zero());
        if (rests(farthest, 1e-12)) return Progress::AtRest;
    }
    return Progress::Going;
}

double PositionRod::energy() const {
    double energy = wall_energy();
    const double l = spec_.segment_length;
    for (int i = 0; i < segments(); ++i) {
        const Vec3 before = i == 0 ? spec_.direction : Vec3((nodes_[i] - nodes_[i - 1]) / l);
        energy += 0.5 * joint_stiffness(i) * ((nodes_[i + 1] - nodes_[i]) / l - before).squaredNorm();
    }
    return energy;
}

}  // namespace baselines
