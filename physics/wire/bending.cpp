#include "physics/wire/bending.h"

#include <Eigen/Geometry>
#include <cassert>
#include <cmath>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

/// dκ/du of a joint: how its cosine changes with a turn of its own segment, the director carried along.
Vec3 cosine_slope(const Vec3& u, const Vec3& next, const RestBend& rest) {
    assert(std::abs(u.squaredNorm() - 1) < 1e-9);
    if (rest.straight()) return next;
    return rest.cosine * next - rest.sine * u.dot(next) * rest.direction;
}

/// Calls use(C, rest bend) for all devices that are straight at the joint, as one, and for each that bends.
template <class Use>
void each_rest(const Chain& chain, const std::vector<Vec3>& d, int joint, const Use& use) {
    assert(joint >= 0 && joint < chain.segments());
    if (chain.straight(joint)) return use(chain.spring_constant(joint), RestBend{});
    const double length = chain.length_of(joint);
    double straight = chain.rigidity[joint];
    for (const Device& device : chain.devices) {
        if (device.rest[joint].angle == 0) continue;
        straight -= device.rigidity[joint];
        use(device.rigidity[joint] / length, rest_bend(device, joint, chain.tangents[joint], d[joint]));
    }
    // The difference of equal sums leaves a rounding.
    constexpr double seen = 1e-12;
    assert(straight >= -seen * chain.rigidity[joint]);
    if (straight > seen * chain.rigidity[joint]) use(straight / length, RestBend{});
}

/// dU/dφ of one rest bend at a joint.
double twist_slope(const Chain& chain, int joint, double c, const RestBend& rest) {
    assert(c > 0 && joint < chain.segments());
    const Vec3 &u = chain.tangents[joint], &next = chain.tangents[joint + 1];
    const double kappa = rest_direction(u, rest).dot(next);
    return -c / 6 * (7 - kappa) * rest.sine * u.cross(rest.direction).dot(next);
}

/// The twist that a turn of both tangents at a joint of the chain adds distal of it, per unit turn.
Vec3 holonomy(const Vec3& from, const Vec3& to) {
    assert(std::abs(from.squaredNorm() - 1) < 1e-9 && std::abs(to.squaredNorm() - 1) < 1e-9);
    return from.cross(to) / std::max(1e-9, 1 + from.dot(to));
}

/// Adds the torques on one device's frame, [i] those at segments from i on.
void add_torque(const Chain& chain, const std::vector<Vec3>& d, int which, std::vector<double>& torque) {
    assert(torque.size() > chain.joints.size() && d.size() == chain.joints.size());
    const Device& device = chain.devices[which];
    const int n = chain.segments();
    double sum = 0, place = chain.inserted_length();
    std::size_t coupling = chain.couplings.size();
    for (int j = n; j >= 0; --j) {
        if (j < n && device.rest[j].angle != 0)
            sum += twist_slope(chain, j, device.rigidity[j] / chain.length_of(j),
                               rest_bend(device, j, chain.tangents[j], d[j]));
        for (; coupling > 0 && chain.couplings[coupling - 1].joint == j; --coupling) {
            const Coupling& c = chain.couplings[coupling - 1];
            if (c.outer == which) sum += coupling_terms(chain, c).slope;
            if (c.inner == which) sum -= coupling_terms(chain, c).slope;
        }
        if (j > 0 && !chain.grips.empty() && device.twists_by_segments() && chain.grips[j].holds() &&
            chain.outermost(place) == which)
            sum += chain.grips[j].push(chain.joints[j]).dot(chain.grips[j].around);
        torque[j] += sum;
        place -= chain.lengths[j];
    }
    assert(coupling == 0 && std::abs(place) < 1e-6);
}

}  // namespace

double bent_joint_energy(const Chain& chain, const std::vector<Vec3>& d, int joint) {
    assert(joint >= 0 && joint < chain.segments() && chain.stored.size() == chain.joints.size());
    const Vec3 &u = chain.tangents[joint], &next = chain.tangents[joint + 1];
    assert(!chain.straight(joint) && std::abs(next.squaredNorm() - 1) < 1e-9);
    double energy = chain.stored[joint];
    each_rest(chain, d, joint, [&](double c, const RestBend& rest) {
        energy += joint_energy(c, rest_direction(u, rest), next);
    });
    return energy;
}

CouplingTerms coupling_terms(const Chain& chain, const Coupling& c) {
    assert(c.inner < c.outer && c.outer < static_cast<int>(chain.devices.size()));
    const double turn = chain.devices[c.outer].angle_at(c.joint) - chain.devices[c.inner].angle_at(c.joint);
    const double cosine = geometry::cos(turn), sine = geometry::sin(turn);
    const double energy = c.along * cosine + c.aside * sine;
    assert(std::abs(energy) <= geometry::hypot(c.along, c.aside) * (1 + 1e-9));
    return {energy, c.aside * cosine - c.along * sine, -energy};
}

double coupling_energy(const Chain& chain, int first) {
    assert(first >= 0);
    double energy = 0;
    for (const Coupling& c : chain.couplings)
        if (c.joint >= first) energy += coupling_terms(chain, c).energy;
    return energy;
}

void frame_torque(const Chain& chain, const std::vector<Vec3>& d, int device, std::vector<double>& torque) {
    torque.assign(chain.joints.size() + 1, 0.0);
    add_torque(chain, d, device, torque);
}

void frame_torque(const Chain& chain, const std::vector<Vec3>& d, std::vector<double>& torque) {
    torque.assign(chain.joints.size() + 1, 0.0);
    for (std::size_t k = 0; k < chain.devices.size(); ++k)
        if (chain.devices[k].framed()) add_torque(chain, d, static_cast<int>(k), torque);
    assert(torque.size() == chain.joints.size() + 1 && torque.back() == 0);
}

BendingTerms bending_terms(const Chain& chain, const std::vector<Vec3>& d, const std::vector<double>& torque,
                           int i) {
    assert(i >= 1 && i <= chain.segments());
    BendingTerms terms;
    const int n = chain.segments();
    const Vec3 &before = chain.tangents[i - 1], &own = chain.tangents[i];
    const auto add = [&](double c, double kappa, const Vec3& slope) {
        terms.pull += c / 6 * (7 - kappa) * slope;
        terms.curvature += c / 6 * slope * slope.transpose();
    };
    each_rest(chain, d, i - 1, [&](double c, const RestBend& bend) {
        const Vec3 rest = rest_direction(before, bend);
        add(c, rest.dot(own), rest);
    });
    if (i < n)
        each_rest(chain, d, i, [&](double c, const RestBend& bend) {
            const Vec3& next = chain.tangents[i + 1];
            add(c, rest_direction(own, bend).dot(next), cosine_slope(own, next, bend));
        });
    if (chain.bent_segments() > 0 && torque[i] != 0) {
        terms.pull += torque[i] * holonomy(before, own);
        if (i < n) terms.pull += torque[i + 1] * holonomy(own, chain.tangents[i + 1]);
    }
    assert(terms.curvature.trace() >= 0);  // positive semidefinite
    return terms;
}

Mat3 neighbour_curvature(const Chain& chain, int joint) {
    assert(joint >= 0 && joint < chain.segments());
    const Vec3 &u = chain.tangents[joint], &next = chain.tangents[joint + 1];
    return chain.spring_constant(joint) / 6 * ((u.dot(next) - 7) * Mat3::Identity() + next * u.transpose());
}

double bending_energy(const Chain& chain) {
    std::vector<Vec3> d;
    if (chain.bent_segments() > 0) d = directors(chain);
    double sum = coupling_energy(chain);
    for (int j = 0; j < chain.segments(); ++j) sum += joint_energy(chain, d, j);
    assert(std::isfinite(sum));
    return sum;
}

}  // namespace physics
