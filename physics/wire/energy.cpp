#include "physics/wire/energy.h"

#include <algorithm>
#include <cassert>

#include "physics/wire/bending.h"

namespace physics {

std::vector<WallContact> all_contacts(const Chain& chain, const LumenWall& wall) {
    assert(chain.stations.size() == chain.joints.size() && chain.thickness.size() == chain.joints.size());
    std::vector<WallContact> contacts(chain.joints.size());
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        contacts[i].station = chain.stations[i];
        contacts[i].thickness = chain.thickness[i];
        contacts[i].held = true;
        contacts[i].fraction = chain.wall_fraction(static_cast<int>(i));
        chain.ask_vessel(static_cast<int>(i), contacts[i]);
    }
    wall.contacts(chain.joints, contacts);
    return contacts;
}

std::vector<Foundation::Load> vessel_loads(const Chain& chain, std::span<const WallContact> contacts) {
    assert(contacts.size() == chain.joints.size());
    std::vector<Foundation::Load> loads;
    for (std::size_t j = 1; j < contacts.size(); ++j)
        if (const WallContact& c = contacts[j]; c.touches())
            if (c.give > 0) loads.push_back({c.station, chain.joints[j] - c.given, c.on_vessel()});
    return loads;
}

Energy total_energy(const Chain& chain, std::span<const WallContact> contacts) {
    assert(contacts.size() == chain.joints.size());
    Energy energy;
    energy.bending = bending_energy(chain);
    for (std::size_t i = 1; i < contacts.size(); ++i) {
        energy.wall += contacts[i].energy();
        // Of the tissue, which is half of forces times ways.
        if (contacts[i].touches()) energy.wall += 0.5 * contacts[i].shift.dot(contacts[i].on_vessel());
    }
    for (int i = 1; i <= chain.segments(); ++i)
        energy.load -= chain.length_of(i) * chain.load.dot(chain.joints[i] - chain.joints[0]);
    energy.torsion = twist_energy(chain);
    energy.friction = grip_energy(chain.grips, chain.joints, 1);
    for (const Rub& rub : chain.rubs) energy.friction += rub.energy();
    assert(energy.torsion >= 0 && std::isfinite(energy.load));
    return energy;
}

std::vector<Vec3> energy_gradient(const Chain& chain, std::span<const WallContact> contacts) {
    assert(contacts.size() == chain.joints.size());
    const int n = chain.segments();
    const bool curved = chain.bent_segments() > 0;
    std::vector<Vec3> d;
    std::vector<double> torque;
    if (curved) {
        d = directors(chain);
        frame_torque(chain, d, torque);
    }
    std::vector<Vec3> gradient(n + 1, Vec3::Zero());
    Vec3 push = Vec3::Zero();
    for (int i = n; i >= 1; --i) {
        push += contacts[i].push() - chain.length_of(i) * chain.load;
        if (!chain.grips.empty() && chain.grips[i].holds()) push += chain.grips[i].push(chain.joints[i]);
        const Vec3 g = chain.lengths[i] * push - bending_terms(chain, d, torque, i).pull;
        gradient[i] = g - g.dot(chain.tangents[i]) * chain.tangents[i];
        assert(!(std::abs(gradient[i].dot(chain.tangents[i])) > 1e-9 * g.norm()));
    }
    return gradient;
}

double relative_gradient(const Chain& chain, std::span<const WallContact> contacts) {
    assert(contacts.size() == chain.joints.size());
    const auto gradient = energy_gradient(chain, contacts);
    double largest = 0;
    for (int i = 1; i <= chain.segments(); ++i)
        largest = std::max(largest, gradient[i].norm() / chain.spring_constant(i - 1));
    if (chain.bent_segments() == 0) return largest;
    const std::vector<Vec3> d = directors(chain);
    std::vector<double> torque;
    for (std::size_t k = 0; k < chain.devices.size(); ++k) {
        const Device& device = chain.devices[k];
        if (device.windup_stiffness == 0 && !device.twists_by_segments()) continue;
        frame_torque(chain, d, static_cast<int>(k), torque);
        if (device.windup_stiffness > 0)
            largest = std::max(largest, std::abs(torque[0] - device.windup_stiffness * device.windup) /
                                            chain.spring_constant(chain.segments() - 1));
        for (std::size_t i = 1; i < device.wound.size(); ++i)
            largest = std::max(
                largest, std::abs(torque[i] + device.torsion[i] * (device.wound[i] - device.wound[i - 1])) /
                             chain.spring_constant(static_cast<int>(i) - 1));
    }
    return largest;
}

double largest_penetration(std::span<const WallContact> contacts) {
    double largest = 0;
    for (std::size_t i = 1; i < contacts.size(); ++i) largest = std::max(largest, contacts[i].pressed_in());
    return largest;
}

double largest_force(std::span<const WallContact> contacts) {
    double largest = 0;
    for (std::size_t i = 1; i < contacts.size(); ++i) largest = std::max(largest, contacts[i].force());
    return largest;
}

}  // namespace physics
