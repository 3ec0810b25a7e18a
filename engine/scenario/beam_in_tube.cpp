#include "engine/scenario/beam_in_tube.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace scenario {
namespace {

using geometry::Vec3;

/// The wall's stiffness over the foundation's: in series they are 5 % softer than the latter, and a harder
/// wall takes more steps.
constexpr double harder = 20;
/// Of each node: two of the beam across the axis, two of the tube. A second difference joins three nodes.
constexpr int of_node = 4, band = 3 * of_node - 1;
constexpr int most_steps = 60, rounds = 3;
constexpr double settled = 0.01;     // of a step [mm]
constexpr double least_part = 1e-3;  // of Newton's step

using Across = Eigen::Matrix<double, 3, 2>;

/// A symmetric matrix with `band` entries beside the diagonal, and its solution.
class Banded {
public:
    explicit Banded(int size) : columns_(static_cast<std::size_t>(size + band)) {}
    double& at(int i, int j) { return i >= j ? columns_[j][i - j] : columns_[i][j - i]; }
    /// LDLᵀ in place, then the answer in place. Positive definite.
    void solve(std::vector<double>& right) {
        const int n = static_cast<int>(columns_.size()) - band;
        right.resize(columns_.size(), 0.0);
        for (int k = 0; k < n; ++k) {
            auto& own = columns_[k];
            const double each = 1 / own[0];
            for (int j = 1; j <= band; ++j) {
                const double fraction = own[j] * each;
                for (int i = j; i <= band; ++i) columns_[k + j][i - j] -= fraction * own[i];
                right[k + j] -= fraction * right[k];
            }
        }
        for (int k = n; k < n + band; ++k) right[k] = 0;
        for (int k = n - 1; k >= 0; --k) {
            for (int i = 1; i <= band; ++i) right[k] -= columns_[k][i] * right[k + i];
            right[k] /= columns_[k][0];
        }
        right.resize(static_cast<std::size_t>(n));
    }

private:
    std::vector<std::array<double, band + 1>> columns_;  // [j][k]: column j, k below the diagonal
};

class Problem {
public:
    Problem(const std::vector<TubeNode>& nodes, double step, bool clamped)
        : nodes_(nodes), step_(step), clamped_(clamped), unknown_(of_node * nodes.size(), 0.0) {
        lay_frames();
        for (const TubeNode& node : nodes) reached_ += node.rigidity > 0;
    }

    std::vector<double> solve() {
        for (int round = 0; round < rounds; ++round) {
            look_along();
            find_rest();
        }
        std::vector<double> aside;
        for (std::size_t i = 0; i < nodes_.size(); ++i)
            aside.push_back(std::hypot(unknown_[of_node * i + 2], unknown_[of_node * i + 3]));
        return aside;
    }

private:
    /// Lengths and directions of the beam as it lies, which are held while a rest is sought.
    void look_along() {
        lengths_.assign(1, step_);
        across_ = frames_;
        std::vector<Vec3> places;
        for (int i = 0; i < reached_; ++i)
            places.push_back(nodes_[i].centre +
                             frames_[i] * Eigen::Vector2d(unknown_[of_node * i], unknown_[of_node * i + 1]));
        for (int i = 1; i < reached_; ++i)
            lengths_.push_back(std::max(0.2 * step_, (places[i] - places[i - 1]).norm()));
        for (int i = 1; i + 1 < reached_; ++i) {
            const Vec3 along = (places[i + 1] - places[i - 1]).normalized(), side = along.unitOrthogonal();
            across_[i] << side, along.cross(side);
        }
    }

    void find_rest() {
        double energy = assemble(unknown_, nullptr, nullptr);
        for (int step = 0; step < most_steps; ++step) {
            Banded hessian(static_cast<int>(unknown_.size()));
            std::vector<double> descent(unknown_.size(), 0.0);
            assemble(unknown_, &descent, &hessian);
            hessian.solve(descent);
            double next = 0, largest = 0;
            std::vector<double> there;
            for (double part = 1; part > least_part; part *= 0.5) {
                there = unknown_;
                for (std::size_t k = 0; k < descent.size(); ++k) there[k] -= part * descent[k];
                next = assemble(there, nullptr, nullptr);
                if (next <= energy) break;
            }
            for (const double w : descent) largest = std::max(largest, std::abs(w));
            unknown_ = std::move(there);
            energy = next;
            if (largest < settled) break;
        }
    }

    /// Of what is held in the axis.
    double holding() const {
        return 1e3 * (nodes_[0].rigidity / (step_ * step_ * step_) + harder * nodes_[0].modulus * step_);
    }
    int count() const { return static_cast<int>(nodes_.size()); }

    /// Carried along the axis without turning about it.
    void lay_frames() {
        Vec3 side = Vec3::Zero();
        for (int i = 0; i < count(); ++i) {
            const Vec3 along =
                (nodes_[std::min(i + 1, count() - 1)].centre - nodes_[std::max(i - 1, 0)].centre)
                    .normalized();
            side -= side.dot(along) * along;
            if (side.norm() < 1e-6) side = along.unitOrthogonal();
            side.normalize();
            frames_.emplace_back();
            frames_.back() << side, along.cross(side);
        }
    }

    /// The energy; with what is asked for, adds its gradient and Hessian.
    double assemble(const std::vector<double>& at, std::vector<double>* gradient, Banded* hessian) const {
        double energy = 0;
        for (int i = 1; i + 1 < count(); ++i) {
            if (i + 1 < reached_) energy += bend(at, i, true, gradient, hessian);
            energy += bend(at, i, false, gradient, hessian);
        }
        for (int i = 0; i < count(); ++i) {
            const bool held = i >= reached_ || (clamped_ && i < 2);
            for (int k = 0; k < 2; ++k) {
                // What does not reach here, or is clamped, stays on the axis.
                if (held) energy += spring(at, of_node * i + k, holding(), gradient, hessian);
                energy += spring(at, of_node * i + 2 + k, nodes_[i].modulus * step_, gradient, hessian);
            }
            if (i < reached_) energy += touch(at, i, gradient, hessian);
        }
        return energy;
    }

    static double spring(const std::vector<double>& at, int k, double stiffness,
                         std::vector<double>* gradient, Banded* hessian) {
        if (gradient) (*gradient)[k] += stiffness * at[k];
        if (hessian) hessian->at(k, k) += stiffness;
        return 0.5 * stiffness * at[k] * at[k];
    }

    /// Of beam or tube at a node: what the directions of its two segments differ by, per length.
    double bend(const std::vector<double>& at, int i, bool beam, std::vector<double>* gradient,
                Banded* hessian) const {
        const double before = beam ? lengths_[i] : step_, behind = beam ? lengths_[i + 1] : step_,
                     cell = 0.5 * (before + behind),
                     stiffness = (beam ? nodes_[i].rigidity : nodes_[i].bending) * cell;
        const std::array<double, 3> weight = {1 / (before * cell), -(1 / before + 1 / behind) / cell,
                                              1 / (behind * cell)};
        const Across& across = beam ? across_[i] : frames_[i];
        const int shift = beam ? 0 : 2;
        Eigen::Matrix<double, 2, 6> jacobian;
        Vec3 bent = beam ? Vec3(-nodes_[i].rest) : Vec3(Vec3::Zero());
        for (int k = 0; k < 3; ++k) {
            const int node = i + k - 1, base = of_node * node + shift;
            bent += weight[k] * (frames_[node] * Eigen::Vector2d(at[base], at[base + 1]));
            if (beam) bent += weight[k] * nodes_[node].centre;
            jacobian.block<2, 2>(0, 2 * k) = weight[k] * across.transpose() * frames_[node];
        }
        const Eigen::Vector2d seen = across.transpose() * bent;
        const auto index = [&](int k) { return of_node * (i + k / 2 - 1) + shift + k % 2; };
        for (int k = 0; k < 6 && gradient; ++k)
            (*gradient)[index(k)] += stiffness * jacobian.col(k).dot(seen);
        for (int k = 0; k < 6 && hessian; ++k)
            for (int l = 0; l <= k; ++l)
                hessian->at(index(k), index(l)) += stiffness * jacobian.col(k).dot(jacobian.col(l));
        return 0.5 * stiffness * seen.squaredNorm();
    }

    double touch(const std::vector<double>& at, int i, std::vector<double>* gradient, Banded* hessian) const {
        const int base = of_node * i;
        const Eigen::Vector2d off(at[base] - at[base + 2], at[base + 1] - at[base + 3]);
        const double far = off.norm(), deep = far - nodes_[i].clearance,
                     k = harder * nodes_[i].modulus * step_;
        if (deep <= 0) return 0;
        const Eigen::Vector2d out = off / far;
        const Eigen::Matrix2d stiff =
            k * (out * out.transpose() + deep / far * (Eigen::Matrix2d::Identity() - out * out.transpose()));
        for (int a = 0; a < of_node && gradient; ++a)
            (*gradient)[base + a] += (a < 2 ? 1 : -1) * k * deep * out[a % 2];
        for (int a = 0; a < of_node && hessian; ++a)
            for (int b = 0; b <= a; ++b)
                hessian->at(base + a, base + b) += (a / 2 == b / 2 ? 1 : -1) * stiff(a % 2, b % 2);
        return 0.5 * k * deep * deep;
    }

    const std::vector<TubeNode>& nodes_;
    const double step_;
    const bool clamped_;
    int reached_ = 0;
    std::vector<Across> frames_;   // of the tube
    std::vector<Across> across_;   // of the beam as it lay when the round began
    std::vector<double> lengths_;  // of its segments then, [i] before node i [mm]
    std::vector<double> unknown_;
};

}  // namespace

std::vector<double> pushed_aside(const std::vector<TubeNode>& nodes, double step, bool clamped) {
    assert(nodes.size() >= 4 && nodes[0].rigidity > 0 && step > 0);
    return Problem(nodes, step, clamped).solve();
}

}  // namespace scenario
