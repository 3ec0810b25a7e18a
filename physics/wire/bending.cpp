#include "physics/wire/bending.h"

#include <Eigen/Geometry>
#include <cmath>

namespace physics {
namespace {

/// dκ_i/du_i: how the cosine at joint i changes with a turn of its own segment, the director carried along.
Vec3 cosine_slope(const Guidewire& wire, const std::vector<Vec3>& d, int joint) {
    const Vec3 &u = wire.tangents[joint], &next = wire.tangents[joint + 1];
    const double beta = wire.rest_angle[joint];
    if (beta == 0) return next;
    return std::cos(beta) * next - std::sin(beta) * u.dot(next) * d[joint];
}

/// The twist that a turn of both tangents at a joint of the chain adds distal of it, per unit turn.
Vec3 holonomy(const Vec3& from, const Vec3& to) {
    return from.cross(to) / std::max(1e-9, 1 + from.dot(to));
}

}  // namespace

double joint_energy(double c, const Vec3& rest, const Vec3& next) {
    const double d = 0.5 * (rest - next).squaredNorm();  // 1 − κ
    return c / 12 * d * (12 + d);
}

Vec3 rest_direction(const Guidewire& wire, int joint, const Vec3& d) {
    const double beta = wire.rest_angle[joint];
    if (beta == 0) return wire.tangents[joint];
    return std::cos(beta) * wire.tangents[joint] + std::sin(beta) * d;
}

double joint_energy(const Guidewire& wire, const std::vector<Vec3>& d, int joint) {
    const double c = wire.spring_constant(joint);
    if (wire.rest_angle[joint] == 0) return joint_energy(c, wire.tangents[joint], wire.tangents[joint + 1]);
    return joint_energy(c, rest_direction(wire, joint, d[joint]), wire.tangents[joint + 1]);
}

void tip_torque(const Guidewire& wire, const std::vector<Vec3>& d, std::vector<double>& torque) {
    const int n = wire.segments(), first = n - wire.curved_segments();
    torque.assign(n + 2, 0.0);
    for (int j = n - 1; j >= first; --j) {
        const Vec3& next = wire.tangents[j + 1];
        const double kappa = rest_direction(wire, j, d[j]).dot(next);
        const double slope = -wire.spring_constant(j) / 6 * (7 - kappa);  // dU/dκ
        torque[j] =
            torque[j + 1] + slope * std::sin(wire.rest_angle[j]) * wire.tangents[j].cross(d[j]).dot(next);
    }
    for (int j = first - 1; j >= 0; --j) torque[j] = torque[first];
}

BendingTerms bending_terms(const Guidewire& wire, const std::vector<Vec3>& d,
                           const std::vector<double>& torque, int i) {
    BendingTerms terms;
    const int n = wire.segments();
    auto add = [&](double c, double kappa, const Vec3& slope) {
        terms.pull += c / 6 * (7 - kappa) * slope;
        terms.curvature += c / 6 * slope * slope.transpose();
    };
    const bool curved = wire.curved_segments() > 0;
    const Vec3 rest = curved ? rest_direction(wire, i - 1, d[i - 1]) : wire.tangents[i - 1];
    add(wire.spring_constant(i - 1), rest.dot(wire.tangents[i]), rest);
    if (i < n) {
        const Vec3 own = curved ? rest_direction(wire, i, d[i]) : wire.tangents[i];
        add(wire.spring_constant(i), own.dot(wire.tangents[i + 1]), cosine_slope(wire, d, i));
    }
    if (curved && torque[i] != 0) {
        terms.pull += torque[i] * holonomy(wire.tangents[i - 1], wire.tangents[i]);
        if (i < n) terms.pull += torque[i + 1] * holonomy(wire.tangents[i], wire.tangents[i + 1]);
    }
    return terms;
}

Mat3 neighbour_curvature(const Guidewire& wire, int joint) {
    const Vec3 &u = wire.tangents[joint], &next = wire.tangents[joint + 1];
    return wire.spring_constant(joint) / 6 * ((u.dot(next) - 7) * Mat3::Identity() + next * u.transpose());
}

double bending_energy(const Guidewire& wire) {
    std::vector<Vec3> d;
    if (wire.curved_segments() > 0) d = directors(wire);
    double sum = 0;
    for (int j = 0; j < wire.segments(); ++j) sum += joint_energy(wire, d, j);
    return sum;
}

}  // namespace physics
