#include "physics/wire/bending.h"

#include <Eigen/Geometry>
#include <cmath>

namespace physics {
namespace {

/// dκ/du of a joint: how its cosine changes with a turn of its own segment, the director carried along.
Vec3 cosine_slope(const Vec3& u, const Vec3& next, const RestBend& rest) {
    if (rest.angle == 0) return next;
    return std::cos(rest.angle) * next - std::sin(rest.angle) * u.dot(next) * rest.way;
}

/// Calls `use(C, rest bend)` for the wire alone, or each device that reaches the joint.
template <class Use>
void each_rest(const Guidewire& wire, const std::vector<Vec3>& d, int joint, const Use& use) {
    if (wire.devices.empty()) {
        const double beta = wire.rest_angle[joint];
        use(wire.spring_constant(joint), RestBend{beta, beta == 0 ? Vec3(Vec3::Zero()) : d[joint]});
        return;
    }
    const double length = wire.length_of(joint);
    for (const CoaxialDevice& device : wire.devices)
        if (device.rigidity[joint] > 0)
            use(device.rigidity[joint] / length,
                device.bend[joint].isZero(0) ? RestBend{}
                                             : rest_bend(device, joint, wire.tangents[joint], d[joint]));
}

/// dU/dψ of one rest bend at a joint.
double twist_slope(const Guidewire& wire, int joint, double c, const RestBend& rest) {
    if (rest.angle == 0) return 0;
    const Vec3 &u = wire.tangents[joint], &next = wire.tangents[joint + 1];
    const double kappa = rest_direction(u, rest).dot(next);
    return -c / 6 * (7 - kappa) * std::sin(rest.angle) * u.cross(rest.way).dot(next);
}

/// The twist that a turn of both tangents at a joint of the chain adds distal of it, per unit turn.
Vec3 holonomy(const Vec3& from, const Vec3& to) {
    return from.cross(to) / std::max(1e-9, 1 + from.dot(to));
}

/// One segment's terms. A wire alone is what segment relaxers spend their time on: nothing here is made for
/// it that only devices need.
template <bool coaxial>
BendingTerms terms_of(const Guidewire& wire, const std::vector<Vec3>& d, const std::vector<double>& torque,
                      int i) {
    BendingTerms terms;
    const int n = wire.segments();
    const Vec3 &before = wire.tangents[i - 1], &own = wire.tangents[i];
    const auto add = [&](double c, double kappa, const Vec3& slope) {
        terms.pull += c / 6 * (7 - kappa) * slope;
        terms.curvature += c / 6 * slope * slope.transpose();
    };
    const bool curved = wire.bent_segments() > 0;
    if constexpr (coaxial) {
        each_rest(wire, d, i - 1, [&](double c, const RestBend& bend) {
            const Vec3 rest = rest_direction(before, bend);
            add(c, rest.dot(own), rest);
        });
        if (i < n)
            each_rest(wire, d, i, [&](double c, const RestBend& bend) {
                const Vec3& next = wire.tangents[i + 1];
                add(c, rest_direction(own, bend).dot(next), cosine_slope(own, next, bend));
            });
    } else {
        const Vec3 rest = curved ? rest_direction(wire, i - 1, d[i - 1]) : before;
        add(wire.spring_constant(i - 1), rest.dot(own), rest);
        if (i < n) {
            const Vec3& next = wire.tangents[i + 1];
            const double beta = wire.rest_angle[i];
            if (beta == 0)
                add(wire.spring_constant(i), own.dot(next), next);
            else
                add(wire.spring_constant(i), rest_direction(wire, i, d[i]).dot(next),
                    cosine_slope(own, next, {beta, d[i]}));
        }
    }
    if (curved && torque[i] != 0) {
        terms.pull += torque[i] * holonomy(before, own);
        if (i < n) terms.pull += torque[i + 1] * holonomy(own, wire.tangents[i + 1]);
    }
    return terms;
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

Vec3 rest_direction(const Vec3& u, const RestBend& rest) {
    if (rest.angle == 0) return u;
    return std::cos(rest.angle) * u + std::sin(rest.angle) * rest.way;
}

double joint_energy(const Guidewire& wire, const std::vector<Vec3>& d, int joint) {
    if (!wire.devices.empty()) return coaxial_energy(wire, joint, d.empty() ? Vec3(Vec3::Zero()) : d[joint]);
    const double c = wire.spring_constant(joint);
    if (wire.rest_angle[joint] == 0) return joint_energy(c, wire.tangents[joint], wire.tangents[joint + 1]);
    return joint_energy(c, rest_direction(wire, joint, d[joint]), wire.tangents[joint + 1]);
}

void tip_torque(const Guidewire& wire, const std::vector<Vec3>& d, std::vector<double>& torque) {
    const int n = wire.segments(), first = n - wire.bent_segments();
    torque.assign(n + 2, 0.0);
    for (int j = n - 1; j >= first; --j) {
        torque[j] = torque[j + 1];
        each_rest(wire, d, j,
                  [&](double c, const RestBend& rest) { torque[j] += twist_slope(wire, j, c, rest); });
    }
    for (int j = first - 1; j >= 0; --j) torque[j] = torque[first];
}

void device_torque(const Guidewire& wire, int device, const std::vector<Vec3>& d,
                   std::vector<double>& torque) {
    const int n = wire.segments();
    const CoaxialDevice& own = wire.devices[device];
    torque.assign(n + 2, 0.0);
    for (int j = n - 1; j >= 0; --j) {
        torque[j] = torque[j + 1];
        if (!own.bend[j].isZero(0))
            torque[j] += twist_slope(wire, j, own.rigidity[j] / wire.length_of(j),
                                     rest_bend(own, j, wire.tangents[j], d[j]));
    }
}

BendingTerms bending_terms(const Guidewire& wire, const std::vector<Vec3>& d,
                           const std::vector<double>& torque, int i) {
    return wire.devices.empty() ? terms_of<false>(wire, d, torque, i) : terms_of<true>(wire, d, torque, i);
}

Mat3 neighbour_curvature(const Guidewire& wire, int joint) {
    const Vec3 &u = wire.tangents[joint], &next = wire.tangents[joint + 1];
    return wire.spring_constant(joint) / 6 * ((u.dot(next) - 7) * Mat3::Identity() + next * u.transpose());
}

double bending_energy(const Guidewire& wire) {
    std::vector<Vec3> d;
    if (wire.bent_segments() > 0) d = directors(wire);
    double sum = 0;
    for (int j = 0; j < wire.segments(); ++j) sum += joint_energy(wire, d, j);
    return sum;
}

}  // namespace physics
