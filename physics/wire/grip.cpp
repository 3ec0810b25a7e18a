#include "physics/wire/grip.h"

#include <cassert>

namespace physics {

double Grip::energy(const Vec3& joint, double turn) const {
    assert(force >= 0 && std::isfinite(turn));
    const double e = stretch(joint, turn).norm();
    return e <= slip_length ? force * e * e / (2 * slip_length) : force * (e - 0.5 * slip_length);
}

Vec3 Grip::push(const Vec3& joint) const {
    assert(force >= 0);
    const Vec3 e = stretch(joint);
    const Vec3 push = force / std::max(slip_length, e.norm()) * e;
    assert(!(push.norm() > force * (1 + 1e-9)));
    return push;
}

Mat3 Grip::stiffness(const Vec3& joint) const {
    assert(force >= 0);
    const Vec3 e = stretch(joint);
    const double size = e.norm();
    Mat3 plane = Mat3::Identity() - normal * normal.transpose();
    if (size <= slip_length) return force / slip_length * plane;
    plane -= e * e.transpose() / (size * size);
    return force / size * plane;
}

double Grip::follow(const Vec3& joint) {
    assert(force >= 0 && joint.allFinite());
    if (!holds()) {
        anchor = joint;
        roll = 0;
        return 0;
    }
    const Vec3 e = stretch(joint);
    const double size = e.norm();
    if (size <= slip_length) return 0;
    const double kept = slip_length / size;
    anchor = joint - kept * (e - roll * around);
    roll *= kept;
    assert(!(std::abs(stretch(joint).norm() - slip_length) > 1e-9));
    return force * (size - slip_length);
}

double Grip::strengthen(const Vec3& joint, double most) {
    assert(holds() && most >= force);
    const double before = energy(joint), kept = force / most;
    anchor = joint - kept * (stretch(joint) - roll * around);
    roll *= kept;
    force = most;
    assert(!(energy(joint) > before + 1e-12));
    return before - energy(joint);
}

double grip_energy(std::span<const Grip> grips, std::span<const Vec3> joints, int first) {
    assert(first >= 0 && (grips.empty() || grips.size() == joints.size()));
    double energy = 0;
    for (std::size_t j = first; j < grips.size(); ++j)
        if (grips[j].holds()) energy += grips[j].energy(joints[j]);
    return energy;
}

}  // namespace physics
