#pragma once
/// A scenario's devices as the physics has them. Nothing else of the engine makes a chain.

#include <span>

#include "engine/scenario/scenario.h"
#include "physics/geometry/polyline.h"
#include "physics/wire/chain.h"

namespace exercise {

/// What a device is made of on the scenario's walls.
physics::DeviceSpec spec_of(const scenario::Scenario&, const scenario::Device&);

/// The devices, innermost first, on a chain along the path, each with the length inside that it says; or with
/// those of the chain `before`, which has the same devices, and with the turns of its hubs. λ and friction
/// are the scenario's. Where it leaves torsion open shafts are rigid, but for those that were not before.
physics::Chain chain_of(const scenario::Scenario&, std::span<const scenario::PlacedDevice>,
                        const geometry::Polyline& path, const physics::Chain* before = nullptr);

/// Puts another device in the place of one that is out.
void exchange(physics::Chain&, int device, const scenario::Scenario&, const scenario::Device& by);

}  // namespace exercise
