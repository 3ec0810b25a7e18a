#include "engine/studies/baselines/beam_rod.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace baselines {
namespace {

constexpr double largest_move = 0.3;  // of a node in one step, over the radius of the lumen [-]
constexpr double tolerance = 1e-10;   // at rest: no node moves farther in a full Newton step [mm]

/// A function of a cosine with its first two derivatives.
struct Jet {
    double value, first, second;
};

/// f = θ/sin θ and θ², θ = acos c. Below a small angle by their series, which keep the digits.
Jet angle_ratio(double c) {
    const double d = 1 - c;
    if (d < 1e-3)
        return {1 + d / 3 + 2 * d * d / 15 + 2 * d * d * d / 35 + 8 * d * d * d * d / 315,
                -(1.0 / 3 + 4 * d / 15 + 6 * d * d / 35 + 32 * d * d * d / 315),
                4.0 / 15 + 12 * d / 35 + 96 * d * d / 315};
    const double s2 = std::max(1 - c * c, 1e-12), f = std::acos(std::clamp(c, -1.0, 1.0)) / std::sqrt(s2);
    // (1 − c²) f' = c f − 1
    const double first = (c * f - 1) / s2;
    return {f, first, (f + 3 * c * first) / s2};
}

Jet angle_square(double c) {
    const Jet f = angle_ratio(c);
    const double s2 = 1 - c * c;  // θ² = f² (1 − c²), its slope −2 f
    return {f.value * f.value * s2, -2 * f.value, -2 * f.first};
}

using Vec9 = Eigen::Matrix<double, 9, 1>;
using Mat9 = Eigen::Matrix<double, 9, 9>;

/// Bending and stretching of one element over (chord, t_1, t_2).
struct Element {
    double energy = 0;
    Vec9 slope = Vec9::Zero();
    Mat9 curvature = Mat9::Zero();
};

double element_energy(const RodSpec& spec, const Vec3& chord, const Vec3& t1, const Vec3& t2) {
    const double l0 = spec.segment_length, l = chord.norm();
    const Vec3 e = chord / l;
    // From |t − e|², which keeps its digits where the rod is nearly straight.
    const auto cosine_of = [&](const Vec3& t) { return 1 - 0.5 * (t - e).squaredNorm(); };
    const double c1 = cosine_of(t1), c2 = cosine_of(t2);
    const Vec3 a = t1 - c1 * e, b = t2 - c2 * e;
    const double f1 = angle_ratio(c1).value, f2 = angle_ratio(c2).value;
    return 0.5 * spec.axial / l0 * (l - l0) * (l - l0) +
           2 * spec.bending / l0 *
               (f1 * f1 * a.squaredNorm() + f1 * f2 * a.dot(b) + f2 * f2 * b.squaredNorm());
}

Element element(const RodSpec& spec, const Vec3& chord, const Vec3& t1, const Vec3& t2) {
    const double l0 = spec.segment_length, l = chord.norm(), stiff = 2 * spec.bending / l0,
                 spring = spec.axial / l0;
    const Vec3 e = chord / l;
    const Mat3 across = Mat3::Identity() - e * e.transpose();
    const double c1 = 1 - 0.5 * (t1 - e).squaredNorm(), c2 = 1 - 0.5 * (t2 - e).squaredNorm();
    const Jet f1 = angle_ratio(c1), f2 = angle_ratio(c2), s1 = angle_square(c1), s2 = angle_square(c2);
    const Vec3 a = t1 - c1 * e, b = t2 - c2 * e;
    const double mixed = a.dot(b);  // t_1·t_2 − c_1 c_2

    // U/stiff = s(c1) + s(c2) + f(c1) f(c2) (q − c1 c2) over the scalars c1, c2, q = t_1·t_2.
    const double ff = f1.value * f2.value;
    Eigen::Vector3d over;
    over << s1.first + f1.first * f2.value * mixed - ff * c2,
        s2.first + f1.value * f2.first * mixed - ff * c1, ff;
    Eigen::Matrix3d twice;
    twice(0, 0) = s1.second + f1.second * f2.value * mixed - 2 * f1.first * f2.value * c2;
    twice(1, 1) = s2.second + f1.value * f2.second * mixed - 2 * f1.value * f2.first * c1;
    twice(0, 1) = twice(1, 0) =
        f1.first * f2.first * mixed - f1.first * f2.value * c1 - f1.value * f2.first * c2 - ff;
    twice(0, 2) = twice(2, 0) = f1.first * f2.value;
    twice(1, 2) = twice(2, 1) = f1.value * f2.first;
    twice(2, 2) = 0;

    Eigen::Matrix<double, 9, 3> slopes = Eigen::Matrix<double, 9, 3>::Zero();
    slopes.block<3, 1>(0, 0) = a / l;
    slopes.block<3, 1>(3, 0) = e;
    slopes.block<3, 1>(0, 1) = b / l;
    slopes.block<3, 1>(6, 1) = e;
    slopes.block<3, 1>(3, 2) = t2;
    slopes.block<3, 1>(6, 2) = t1;

    Element out;
    out.slope = stiff * slopes * over;
    out.curvature = stiff * slopes * twice * slopes.transpose();
    const auto add_cosine = [&](double weight, double c, const Vec3& part, int t) {
        out.curvature.block<3, 3>(0, 0) -=
            weight / (l * l) * (e * part.transpose() + part * e.transpose() + c * across);
        out.curvature.block<3, 3>(t, 0) += weight / l * across;
        out.curvature.block<3, 3>(0, t) += weight / l * across;
    };
    add_cosine(stiff * over[0], c1, a, 3);
    add_cosine(stiff * over[1], c2, b, 6);
    out.curvature.block<3, 3>(3, 6) += stiff * over[2] * Mat3::Identity();
    out.curvature.block<3, 3>(6, 3) += stiff * over[2] * Mat3::Identity();
    out.slope.head<3>() += spring * (l - l0) * e;
    out.curvature.block<3, 3>(0, 0) += spring * (e * e.transpose() + (l - l0) / l * across);
    out.energy = element_energy(spec, chord, t1, t2);
    return out;
}

}  // namespace

void BeamRod::start(const std::vector<Vec3>& nodes) {
    take(nodes);
    const int n = segments();
    directions_.assign(nodes_.size(), spec_.direction.normalized());
    for (int i = 1; i <= n; ++i) {
        const Vec3 before = nodes_[i] - nodes_[i - 1],
                   after = i < n ? Vec3(nodes_[i + 1] - nodes_[i]) : before;
        const Vec3 both = before.normalized() + after.normalized();
        directions_[i] = (both.norm() > 1e-6 ? both : before).normalized();
    }
    if (n > 1) {  // a free end bends no more: its element is an arc that ends straight
        const Vec3 chord = (nodes_[n] - nodes_[n - 1]).normalized();
        directions_[n] = (3 * chord - directions_[n - 1]).normalized();
    }
    planes_.resize(nodes_.size());
    gradient_.assign(nodes_.size(), Vec5::Zero());
    step_ = gradient_;
    own_.assign(nodes_.size(), Mat5::Zero());
    next_ = factor_ = own_;
    shift_ = 0;
}

void BeamRod::assemble() {
    const int n = segments();
    for (int i = 0; i <= n; ++i) {
        const Vec3& t = directions_[i];
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (std::abs(t[k]) < std::abs(t[axis])) axis = k;
        planes_[i].col(0) = t.cross(Vec3::Unit(axis)).normalized();
        planes_[i].col(1) = t.cross(planes_[i].col(0));
        gradient_[i].setZero();
        own_[i].setZero();
        next_[i].setZero();
    }
    for (int i = 0; i < n; ++i) {
        const Element part = element(spec_, nodes_[i + 1] - nodes_[i], directions_[i], directions_[i + 1]);
        // Over (x_i, α_i, x_{i+1}, α_{i+1}): the chord is x_{i+1} − x_i, t turns by its plane's basis, and
        // t(α) curves back to the sphere by −(t·∇U) |α|²/2.
        const Vec3 along = part.slope.head<3>();
        const Mat3 k = part.curvature.block<3, 3>(0, 0);
        const Mat32 &p = planes_[i], &q = planes_[i + 1];
        const Mat32 kp = part.curvature.block<3, 3>(0, 3) * p, kq = part.curvature.block<3, 3>(0, 6) * q;
        gradient_[i].head<3>() -= along;
        gradient_[i + 1].head<3>() += along;
        gradient_[i].tail<2>() += p.transpose() * part.slope.segment<3>(3);
        gradient_[i + 1].tail<2>() += q.transpose() * part.slope.segment<3>(6);
        own_[i].block<3, 3>(0, 0) += k;
        own_[i].block<3, 2>(0, 3) -= kp;
        own_[i].block<2, 3>(3, 0) -= kp.transpose();
        own_[i].block<2, 2>(3, 3) +=
            p.transpose() * part.curvature.block<3, 3>(3, 3) * p -
            directions_[i].dot(part.slope.segment<3>(3)) * Eigen::Matrix2d::Identity();
        own_[i + 1].block<3, 3>(0, 0) += k;
        own_[i + 1].block<3, 2>(0, 3) += kq;
        own_[i + 1].block<2, 3>(3, 0) += kq.transpose();
        own_[i + 1].block<2, 2>(3, 3) +=
            q.transpose() * part.curvature.block<3, 3>(6, 6) * q -
            directions_[i + 1].dot(part.slope.segment<3>(6)) * Eigen::Matrix2d::Identity();
        next_[i].block<3, 3>(0, 0) -= k;
        next_[i].block<3, 2>(0, 3) -= kq;
        next_[i].block<2, 3>(3, 0) += kp.transpose();
        next_[i].block<2, 2>(3, 3) += p.transpose() * part.curvature.block<3, 3>(3, 6) * q;
    }
    gradient_[n].head<3>() -= spec_.load;
    gradient_[n].tail<2>() += planes_[n].transpose() * directions_[n].cross(spec_.moment);
    if (!tube_) return;
    for (int i = 1; i <= n; ++i) {
        const Touch wall = touch(i, true);
        if (!(wall.depth > 0)) continue;
        const double stiff = wall_stiffness(i);
        gradient_[i].head<3>() += stiff * wall.depth * wall.normal;
        own_[i].block<3, 3>(0, 0) +=
            stiff * (wall.normal * wall.normal.transpose() + wall.depth * wall.curvature);
    }
}

/// From the tip inwards; false where the shifted tangent is not positive definite.
bool BeamRod::solve(double shift) {
    ++tally_.solves;
    const int n = segments();
    const double l2 = spec_.segment_length * spec_.segment_length;
    Vec5 diagonal;
    diagonal << shift, shift, shift, shift * l2, shift * l2;
    Mat5 carried = Mat5::Zero();
    Vec5 right = Vec5::Zero();
    for (int i = n; i >= 1; --i) {
        Mat5 block = own_[i] - carried;
        block.diagonal() += diagonal;
        const Eigen::LLT<Mat5> llt(block);
        if (llt.info() != Eigen::Success) return false;
        const Mat5 lower = llt.matrixL();
        if (!(lower.diagonal().minCoeff() > 1e-7 * lower.diagonal().maxCoeff())) return false;
        step_[i] = llt.solve(-gradient_[i] - right);
        factor_[i] = llt.solve(next_[i - 1].transpose());
        carried = next_[i - 1] * factor_[i];
        right = next_[i - 1] * step_[i];
    }
    step_[0].setZero();
    for (int i = 2; i <= n; ++i) step_[i] -= factor_[i] * step_[i - 1];
    return true;
}

void BeamRod::move(double fraction) {
    for (int i = 1; i <= segments(); ++i) {
        nodes_[i] += fraction * step_[i].head<3>();
        directions_[i] = (directions_[i] + fraction * (planes_[i] * step_[i].tail<2>())).normalized();
    }
}

Progress BeamRod::advance(int rounds) {
    if (diverged_) return Progress::Diverged;
    const int n = segments();
    const double least = 1e-6 * spec_.bending / std::pow(spec_.segment_length, 3),
                 cap = largest_move * (tube_ ? tube_->radius() : n * spec_.segment_length);
    for (int round = 0; round < rounds; ++round) {
        assemble();
        ++tally_.rounds;
        double farthest = 0, slope = 0;
        for (int tries = 0;; ++tries) {
            bool fits = solve(shift_);
            if (fits) {
                farthest = slope = 0;
                for (int i = 1; i <= n; ++i) {
                    farthest = std::max(farthest, step_[i].head<3>().cwiseAbs().maxCoeff());
                    slope += gradient_[i].dot(step_[i]);
                }
                fits = farthest <= cap && slope <= 0;
            }
            if (fits) break;
            if (tries > 60 || !std::isfinite(farthest)) {
                diverged_ = !std::isfinite(farthest);
                return diverged_ ? Progress::Diverged : Progress::Stuck;
            }
            shift_ = std::max(4 * shift_, least);
        }
        if (shift_ == 0 && farthest < tolerance) {
            move(1);
            return Progress::AtRest;
        }
        const double start = energy();
        const std::vector<Vec3> places = nodes_, directions = directions_;
        const std::vector<double> arcs = arcs_;
        double fraction = 1;
        bool lower = false;
        for (int tries = 0; tries < 12 && !lower; ++tries, fraction *= 0.5) {
            move(fraction);
            if (tube_) tally_.wall_queries += n;
            const double there = energy();
            // Below the arithmetic's noise in the energy a Newton step is taken as it is.
            lower =
                there <= start + 1e-4 * fraction * slope || (shift_ == 0 && -slope < 1e-11 * std::abs(start));
            if (!lower) nodes_ = places, directions_ = directions, arcs_ = arcs;
        }
        if (lost()) {
            nodes_ = places, directions_ = directions;
            diverged_ = true;
            return Progress::Diverged;
        }
        if (!lower) {
            if (shift_ > 1e12 * least) return Progress::Stuck;
            shift_ = std::max(10 * shift_, least);
        } else if (fraction > 0.3) {
            shift_ = shift_ < 10 * least ? 0 : 0.2 * shift_;
        }
    }
    return Progress::Going;
}

double BeamRod::energy() const {
    double energy = wall_energy();
    for (int i = 0; i < segments(); ++i)
        energy += element_energy(spec_, nodes_[i + 1] - nodes_[i], directions_[i], directions_[i + 1]);
    const double moment = spec_.moment.norm();
    if (moment == 0) return energy;
    // Of the turn in the moment's plane, where the beam is supposed to stay.
    const Vec3 &from = spec_.direction, &to = directions_.back();
    return energy - moment * std::atan2(spec_.moment.dot(from.cross(to)) / moment, from.dot(to));
}

}  // namespace baselines
