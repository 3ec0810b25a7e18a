#include "physics/wall/narrowed_wall.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

constexpr double around_axis = 0.05;  // the tube's depth is rounded off so near its axis [mm]
constexpr double ends_from = 1.05;    // of the lumen's radius: there the tube begins to end [-]
constexpr double end_width = 0.6;     // of the lumen's radius: over so much more it does [-]
constexpr double blend = 0.1;         // two walls as near to each other as this are rounded off [mm]
constexpr int window = 8;             // samples on either side that count: the next weighs e⁻³²

/// 0 to 1, with its first and second derivative.
struct Step {
    double value = 0, slope = 0, curve = 0;
};
Step smooth_step(double t) {
    if (t <= 0) return {};
    if (t >= 1) return {1, 0, 0};
    return {t * t * t * (t * (6 * t - 15) + 10), 30 * t * t * (t - 1) * (t - 1),
            60 * t * (2 * t * t - 3 * t + 1)};
}

using Sample = Narrowing::Sample;

/// The samples that count at a place, and their weights.
struct Weights {
    std::size_t first = 0, count = 0;
    double w[2 * window + 1], sum = 0;

    Weights(std::span<const Sample> samples, const Vec3& x) {
        assert(!samples.empty());
        std::size_t nearest = 0;
        double least = (samples[0].at - x).squaredNorm();
        for (std::size_t k = 1; k < samples.size(); ++k)
            if (const double d = (samples[k].at - x).squaredNorm(); d < least) least = d, nearest = k;
        first = nearest < window ? 0 : nearest - window;
        count = std::min(samples.size(), nearest + window + 1) - first;
        constexpr double of_square = -0.5 / (Narrowing::spacing * Narrowing::spacing);
        for (std::size_t k = 0; k < count; ++k)
            sum += w[k] = geometry::exp(of_square * ((samples[first + k].at - x).squaredNorm() - least));
        for (std::size_t k = 0; k < count; ++k) w[k] /= sum;
    }
};

/// Of what is known at samples.
struct Mean {
    Vec3 at = Vec3::Zero(), centre = Vec3::Zero();       // of the vessel, of the tube [mm]
    double radius = 0, lumen = 0, gives = 0, wider = 0;  // [mm]

    Mean(std::span<const Sample> samples, const Weights& weights) {
        for (std::size_t k = 0; k < weights.count; ++k) {
            const Sample& sample = samples[weights.first + k];
            at += weights.w[k] * sample.at;
            centre += weights.w[k] * (sample.at + sample.aside);
            radius += weights.w[k] * sample.radius;
            lumen += weights.w[k] * sample.lumen;
            gives += weights.w[k] * sample.gives;
            wider += weights.w[k] * sample.wider;
        }
    }
};

/// The larger of two depths, rounded off where they are alike: what a joint meets of two walls.
void take_deeper(WallContact& wall, const Narrowing::Depth& tube) {
    const double more = wall.penetration - tube.value;
    if (more >= blend || (std::abs(more) < blend && wall.normal.isZero(0) && more > 0)) return;
    if (more <= -blend || wall.normal.isZero(0)) {
        wall.penetration = tube.value;
        wall.normal = tube.gradient;
        wall.curvature = tube.hessian;
        return;
    }
    const double h = (blend - std::abs(more)) / blend, lesser = 0.5 * h * h;
    const double of_wall = more > 0 ? 1 - lesser : lesser;
    const Vec3 apart = wall.normal - tube.gradient;
    wall.penetration = std::max(wall.penetration, tube.value) + blend / 6 * h * h * h;
    wall.normal = of_wall * wall.normal + (1 - of_wall) * tube.gradient;
    wall.curvature =
        of_wall * wall.curvature + (1 - of_wall) * tube.hessian + h / blend * apart * apart.transpose();
}

}  // namespace

/// Weights proportional to exp(−|x − p|²/2σ²) are an exponential family in x/σ²: derivatives of means are
/// covariances over σ², second derivatives third central moments over σ⁴.
bool Narrowing::depth(const Vec3& x, double joint, Depth& out) const {
    const Weights at(samples, x);
    constexpr double s2 = spacing * spacing, s4 = s2 * s2;
    const Mean mean(samples, at);
    double widest = 0;
    for (const Sample& sample : samples) widest = std::max(widest, sample.lumen);
    const Vec3 q = x - mean.centre;
    const double rho = std::sqrt(q.squaredNorm() + around_axis * around_axis);
    const double width = end_width * widest, ends = (rho - ends_from * mean.lumen) / width;
    out.radius = mean.radius + mean.gives;
    out.free = ends >= 1 ? (ends - 1) * width : 0;
    if (ends >= 1) return false;
    Mat3 spread = Mat3::Zero(), third = Mat3::Zero(), of_radius = Mat3::Zero(), of_lumen = Mat3::Zero();
    Vec3 to_radius = Vec3::Zero(), to_lumen = Vec3::Zero();
    for (std::size_t k = 0; k < at.count; ++k) {
        const Sample& sample = samples[at.first + k];
        const Vec3 along = sample.at - mean.at, d = sample.at + sample.aside - mean.centre;
        const Mat3 square = at.w[k] * along * along.transpose();
        const double r = sample.radius - mean.radius, l = sample.lumen - mean.lumen;
        spread += at.w[k] * d * along.transpose();
        third += q.dot(d) * square;
        to_radius += at.w[k] * r * along;
        of_radius += r * square;
        to_lumen += at.w[k] * l * along;
        of_lumen += l * square;
    }
    const Mat3 across = Mat3::Identity() - spread / s2;
    const Vec3 slope = across.transpose() * q / rho;
    const Mat3 bend = (across.transpose() * across - third / s4 - slope * slope.transpose()) / rho;
    out.value = rho - mean.radius + joint;
    out.gradient = slope - to_radius / s2;
    out.hessian = bend - of_radius / s4;
    if (ends <= 0) return true;
    const double fall = 2 * widest + 5;  // more than any joint is deep [mm]
    const Step step = smooth_step(ends);
    const Vec3 slope_of_width = (slope - ends_from * to_lumen / s2) / width;
    out.value -= fall * step.value;
    out.gradient -= fall * step.slope * slope_of_width;
    out.hessian -= fall * (step.curve * slope_of_width * slope_of_width.transpose() +
                           step.slope / width * (bend - ends_from * of_lumen / s4));
    return true;
}

Vec3 Narrowing::inward(const Vec3& x) const {
    const Mean mean(samples, Weights(samples, x));
    double widest = 0;
    for (const Sample& sample : samples) widest = std::max(widest, sample.lumen);
    const double away = (x - mean.centre).norm(), deep = away - mean.radius;
    if (away == 0 || (deep <= 0 && mean.wider <= 0)) return Vec3::Zero();
    const double there = 1 - smooth_step((away - ends_from * mean.lumen) / (end_width * widest)).value;
    return there * (deep > 0 ? deep : -mean.wider) / away * (mean.centre - x);
}

std::pair<double, double> Narrowing::holds_with(const Vec3& x) const {
    const Weights at(samples, x);
    Vec3 centre = Vec3::Zero();
    double lumen = 0, shear = 0, pressure = 0;
    for (std::size_t k = 0; k < at.count; ++k) {
        const Sample& sample = samples[at.first + k];
        centre += at.w[k] * sample.at;
        lumen += at.w[k] * sample.lumen;
        shear += at.w[k] * sample.shear;
        pressure += at.w[k] * sample.pressure;
    }
    const double inside = 1 - smooth_step((x - centre).norm() / lumen - 1).value;
    return {inside * shear, inside * pressure};
}

NarrowedWall::NarrowedWall(std::shared_ptr<const LumenWall> vessels, double wire_radius)
    : vessels_(std::move(vessels)), wire_radius_(wire_radius) {
    assert(vessels_ && wire_radius >= 0);
    if (const Foundation* foundation = vessels_->foundation())
        lie_in(std::shared_ptr<const Foundation>(vessels_, foundation));
}

void NarrowedWall::narrow(std::vector<Narrowing> narrowings) {
    narrowings_ = std::move(narrowings);
    balls_.clear();
    for (const Narrowing& narrowing : narrowings_) {
        const std::vector<Sample>& samples = narrowing.samples;
        assert(!samples.empty());
        Ball ball{samples[samples.size() / 2].at, 0};
        double reach = 0, widest = 0;
        for (const Sample& sample : samples) {
            reach = std::max(reach, (sample.at + sample.aside - ball.centre).norm());
            widest = std::max(widest, sample.lumen);
        }
        ball.radius = reach + (ends_from + end_width) * widest;
        balls_.push_back(ball);
    }
}

void NarrowedWall::stand_in(const Narrowing& narrowing, const Vec3& x, WallContact& c) const {
    const double joint = wire_radius_ + c.thickness;
    const bool knows_stiffness = !c.normal.isZero(0);
    Narrowing::Depth tube;
    const bool there = narrowing.depth(x, joint, tube);
    c.trust = std::min(c.trust, tube.free);
    if (!there) return;
    take_deeper(c, tube);
    if (!knows_stiffness && !c.normal.isZero(0)) vessels_->apply_stiffness(x, c);
}

void NarrowedWall::rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const {
    vessels_->rigid_contacts(joints, contacts);
    for (std::size_t n = 0; n < narrowings_.size(); ++n)
        for (std::size_t i = 0; i < joints.size(); ++i) {
            const double away = (joints[i] - balls_[n].centre).norm() - balls_[n].radius;
            if (away > 0)
                contacts[i].trust = std::min(contacts[i].trust, away);
            else
                stand_in(narrowings_[n], joints[i], contacts[i]);
        }
}

Vec3 NarrowedWall::inward(const Vec3& x) const {
    Vec3 farthest = Vec3::Zero();
    for (std::size_t n = 0; n < narrowings_.size(); ++n) {
        if ((x - balls_[n].centre).norm() > balls_[n].radius) continue;
        const Vec3 by = narrowings_[n].inward(x);
        if (by.squaredNorm() > farthest.squaredNorm()) farthest = by;
    }
    return farthest;
}

double NarrowedWall::narrowest(const Vec3& x) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < narrowings_.size(); ++n) {
        Narrowing::Depth tube;
        if ((x - balls_[n].centre).norm() < balls_[n].radius && narrowings_[n].depth(x, 0, tube))
            least = std::min(least, tube.radius);
    }
    return least;
}

double NarrowedWall::holds(const Vec3& x, double radius, double friction) const {
    double sum = 0;
    for (std::size_t n = 0; n < narrowings_.size(); ++n) {
        if ((x - balls_[n].centre).norm() > balls_[n].radius) continue;
        const auto [shear, pressure] = narrowings_[n].holds_with(x);
        sum += 2 * std::numbers::pi * radius * (shear + friction * pressure);
    }
    return sum;
}

}  // namespace physics
