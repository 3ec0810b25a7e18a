#pragma once
/// Energy of a wire in its vessel and its exact gradient.

#include "physics/wall/wall.h"
#include "physics/wire/guidewire.h"

namespace physics {

struct Energy {
    double bending = 0, wall = 0;  // [N·mm]
    double load = 0;               // what the load has yet to do, 0 with the wire at the introducer [N·mm]
    double total() const { return bending + wall + load; }
};

/// Contacts of all joints from scratch (stations of the wire as hints), each with its share of the wall's
/// stiffness.
std::vector<WallContact> all_contacts(const Guidewire&, const LumenWall&);

Energy total_energy(const Guidewire&, std::span<const WallContact>);

/// [i] = dU/du_i projected on the plane ⟂ u_i, i = 1…N, [0] zero [N·mm]. Includes the turn of the tip's rest
/// direction with every tangent proximal of it (parallel transport).
std::vector<Vec3> energy_gradient(const Guidewire&, std::span<const WallContact>);

/// Largest |dU/du_i| over C of that joint: zero at equilibrium [-].
double relative_gradient(const Guidewire&, std::span<const WallContact>);

double largest_penetration(std::span<const WallContact>);  // ≥ 0 [mm]
double largest_force(std::span<const WallContact>);        // ≥ 0 [N]

}  // namespace physics
