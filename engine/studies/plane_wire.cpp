#include "engine/studies/plane_wire.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace studies {
namespace {

using geometry::Vec2;
using geometry::Vec3;
using State = Eigen::Matrix<double, 7, 1>;  // x, y, φ, M, n_x, n_y, energy

constexpr int step_count = 4000;  // along the wire, or as many more as make whole intervals

State slope(const PlaneWire& wire, double rigidity, const State& v) {
    const double c = std::cos(v[2]), s = std::sin(v[2]);
    State d;
    d << c, s, v[3] / rigidity, v[4] * s - v[5] * c, -wire.load,
        v[3] * v[3] / (2 * rigidity) - wire.load.dot(v.head<2>());
    return d;
}

State step(const PlaneWire& wire, double ei, const State& v, double h) {
    const State a = slope(wire, ei, v), b = slope(wire, ei, v + h / 2 * a),
                c = slope(wire, ei, v + h / 2 * b), d = slope(wire, ei, v + h * c);
    return v + h / 6 * (a + 2 * b + 2 * c + d);
}

/// A step from s on, in two where EI jumps within it.
State step_from(const PlaneWire& wire, double s, const State& v, double h) {
    const double stiffer = std::clamp(wire.stiffer_length - s, 0.0, h);
    State next = v;
    if (stiffer > 0) next = step(wire, wire.stiffer_rigidity, next, stiffer);
    return stiffer < h ? step(wire, wire.rigidity, next, h - stiffer) : next;
}

PlaneContact contact(const PlaneWire& wire, const Vec2& x) {
    return wire.wall ? wire.wall(x) : PlaneContact{};
}

/// Residual of M and n at the tip. The wall acts on the tip as a spring that also pulls, or shooting would
/// miss it: n shows the caller whether it pulls in the end.
Vec3 miss(const PlaneWire& wire, const State& tip) {
    const PlaneContact wall = contact(wire, tip.head<2>());
    const Vec2 push = wire.tip_stiffness * wall.penetration * wall.normal;
    return {tip[3], tip[4] + push[0], tip[5] + push[1]};
}

/// All points of the curve for M and n at the clamp.
std::vector<State> shoot(const PlaneWire& wire, int intervals, int steps, const Vec3& clamp) {
    std::vector<State> points;
    State v;
    v << 0, 0, wire.angle, clamp, 0;
    points.push_back(v);
    const double h = wire.length / intervals / steps;
    for (int i = 0; i < intervals; ++i) {
        for (int k = 0; k < steps; ++k) v = step_from(wire, (i * steps + k) * h, v, h);
        points.push_back(v);
    }
    return points;
}

/// M and n at the clamp that satisfy the conditions at the tip.
Vec3 solve(const PlaneWire& wire, int intervals, int steps, Vec3 clamp) {
    const auto missed = [&](const Vec3& c) { return miss(wire, shoot(wire, intervals, steps, c).back()); };
    Vec3 best = clamp;
    double least = missed(clamp).norm();
    for (int round = 0; round < 30; ++round) {
        geometry::Mat3 slopes;
        const double h = 1e-6 * std::max(1e-6, clamp.norm());
        for (int k = 0; k < 3; ++k)
            slopes.col(k) = (missed(clamp + h * Vec3::Unit(k)) - missed(clamp - h * Vec3::Unit(k))) / (2 * h);
        clamp -= slopes.fullPivLu().solve(missed(clamp));
        const double now = missed(clamp).norm();
        if (now < least)
            best = clamp, least = now;
        else if (round > 5)
            break;  // rounding
    }
    return best;
}

}  // namespace

PlaneCurve exact_curve(const PlaneWire& wire, int intervals, double moment, const Vec2& force) {
    const int steps = (step_count + intervals - 1) / intervals;
    const Vec3 coarse = solve(wire, intervals, steps, {moment, force[0], force[1]});
    const Vec3 fine = solve(wire, intervals, 2 * steps, coarse);
    const auto before = shoot(wire, intervals, steps, coarse),
               points = shoot(wire, intervals, 2 * steps, fine);
    PlaneCurve curve;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const State& v = points[i];
        curve.points.push_back({v.head<2>(), v[2], v[3], v.segment<2>(4)});
        curve.step_error = std::max(curve.step_error, (v - before[i]).head<2>().norm());
    }
    const double pen = contact(wire, points.back().head<2>()).penetration;
    curve.energy = points.back()[6] + 0.5 * wire.tip_stiffness * pen * pen;
    curve.residual = miss(wire, points.back()).lpNorm<Eigen::Infinity>();
    return curve;
}

}  // namespace studies
