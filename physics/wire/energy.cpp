#include "physics/wire/energy.h"

#include <algorithm>

#include "physics/wire/bending.h"

namespace physics {

std::vector<WallContact> all_contacts(const Guidewire& wire, const LumenWall& wall) {
    std::vector<WallContact> contacts(wire.joints.size());
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        contacts[i].station = wire.stations[i];
        contacts[i].thickness = wire.thickness_at(static_cast<int>(i));
        contacts[i].held = true;
    }
    wall.contacts(wire.joints, contacts);
    for (int i = 0; i <= wire.segments(); ++i) contacts[i].share_stiffness(wire.wall_share(i));
    return contacts;
}

Energy total_energy(const Guidewire& wire, std::span<const WallContact> contacts) {
    Energy energy;
    energy.bending = bending_energy(wire);
    for (std::size_t i = 1; i < contacts.size(); ++i) energy.wall += contacts[i].energy();
    for (int i = 1; i <= wire.segments(); ++i)
        energy.load -= wire.length_of(i) * wire.load.dot(wire.joints[i] - wire.joints[0]);
    energy.torsion = 0.5 * wire.windup_torque() * wire.windup;
    energy.torsion += windup_energy(wire) + twist_energy(wire, wire.twists, 1);
    energy.friction = grip_energy(wire.grips, wire.joints, 1);
    return energy;
}

namespace {

/// tip_torque(), and that of the wall's grips on the material.
void frame_torque(const Guidewire& wire, const std::vector<Vec3>& d, std::vector<double>& torque) {
    tip_torque(wire, d, torque);
    if (wire.twists.empty() || wire.grips.empty()) return;
    double sum = 0;
    for (int i = wire.segments(); i >= 0; --i) {
        if (i > 0 && wire.grips[i].holds())
            sum += wire.grips[i].push(wire.joints[i]).dot(wire.grips[i].around);
        torque[i] += sum;
    }
}

}  // namespace

std::vector<Vec3> energy_gradient(const Guidewire& wire, std::span<const WallContact> contacts) {
    const int n = wire.segments();
    const bool curved = wire.bent_segments() > 0;
    std::vector<Vec3> d;
    std::vector<double> torque;
    if (curved) {
        d = directors(wire);
        frame_torque(wire, d, torque);
    }
    std::vector<Vec3> gradient(n + 1, Vec3::Zero());
    Vec3 push = Vec3::Zero();
    for (int i = n; i >= 1; --i) {
        push += contacts[i].push() - wire.length_of(i) * wire.load;
        if (!wire.grips.empty() && wire.grips[i].holds()) push += wire.grips[i].push(wire.joints[i]);
        const Vec3 g = wire.lengths[i] * push - bending_terms(wire, d, torque, i).pull;
        gradient[i] = g - g.dot(wire.tangents[i]) * wire.tangents[i];
    }
    return gradient;
}

double relative_gradient(const Guidewire& wire, std::span<const WallContact> contacts) {
    const auto gradient = energy_gradient(wire, contacts);
    double largest = 0;
    for (int i = 1; i <= wire.segments(); ++i)
        largest = std::max(largest, gradient[i].norm() / wire.spring_constant(i - 1));
    if (!wire.twists.empty()) {
        std::vector<double> torque;
        frame_torque(wire, directors(wire), torque);
        for (int i = 1; i <= wire.segments(); ++i)
            largest = std::max(largest, std::abs(torque[i] + wire.torsion[i] * wire.twists[i]) /
                                            wire.spring_constant(i - 1));
    }
    if (wire.windup_stiffness() > 0) {
        const std::vector<Vec3> d = directors(wire);
        std::vector<double> torque;
        tip_torque(wire, d, torque);
        largest = std::max(
            largest, std::abs(torque[0] - wire.windup_torque()) / wire.spring_constant(wire.segments() - 1));
    }
    if (wire.devices.empty()) return largest;
    const std::vector<Vec3> d = directors(wire);
    std::vector<double> torque;
    for (std::size_t k = 0; k < wire.devices.size(); ++k) {
        const double stiffness = windup_stiffness(wire.devices[k]);
        if (stiffness == 0) continue;
        device_torque(wire, static_cast<int>(k), d, torque);
        largest = std::max(largest, std::abs(torque[0] - stiffness * wire.devices[k].windup) /
                                        wire.spring_constant(wire.segments() - 1));
    }
    return largest;
}

double euler_force(double rigidity, double length) {
    return 4 * M_PI * M_PI * rigidity / (length * length);
}

double hand_force(const Guidewire& wire, double held) {
    const std::vector<Vec3> at_hub = {rolled_director(wire)};
    return held - joint_energy(wire, at_hub, 0) / wire.length_of(0);
}

double largest_penetration(std::span<const WallContact> contacts) {
    double largest = 0;
    for (std::size_t i = 1; i < contacts.size(); ++i) largest = std::max(largest, contacts[i].penetration);
    return largest;
}

double largest_force(std::span<const WallContact> contacts) {
    double largest = 0;
    for (std::size_t i = 1; i < contacts.size(); ++i) largest = std::max(largest, contacts[i].force());
    return largest;
}

}  // namespace physics
