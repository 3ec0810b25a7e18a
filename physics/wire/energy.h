#pragma once
/// Energy of a chain in its vessel and its exact gradient.

#include "physics/wall/foundation.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

struct Energy {
    double bending = 0, wall = 0;  // [N·mm]
    double load = 0;      // work that the load has yet to do, 0 with the wire at the introducer [N·mm]
    double torsion = 0;   // of the devices' shafts [N·mm]
    double friction = 0;  // of the grips, with their normal forces held, and of the rubs [N·mm]
    double total() const { return bending + wall + load + torsion + friction; }
};

/// Contacts of all joints from scratch, each with its fraction of the wall's stiffness. The wire's stations
/// are hints; near the border of two vessels a joint stays with the vessel of its station, where it came to
/// rest.
std::vector<WallContact> all_contacts(const Chain&, const LumenWall&);

/// What these contacts of the chain's joints press on the vessels, where those were before they made way.
std::vector<Foundation::Load> vessel_loads(const Chain&, std::span<const WallContact>);

Energy total_energy(const Chain&, std::span<const WallContact>);

/// [i] = dU/du_i projected on the plane ⟂ u_i, i = 1…N, [0] zero [N·mm]. Includes the turn of the devices'
/// rest directions with every tangent proximal of them (parallel transport).
std::vector<Vec3> energy_gradient(const Chain&, std::span<const WallContact>);

/// Largest |dU/du_i| over C of that joint: zero at equilibrium [-].
double relative_gradient(const Chain&, std::span<const WallContact>);

double largest_penetration(std::span<const WallContact>);  // ≥ 0 [mm]
double largest_force(std::span<const WallContact>);        // ≥ 0 [N]

}  // namespace physics
