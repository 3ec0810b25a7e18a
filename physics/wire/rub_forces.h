#pragma once
/// How much friction between devices can be now: for those who follow it and those who move devices by it.

#include <span>
#include <vector>

#include "physics/wire/feed.h"

namespace physics {

/// Where the surfaces slide by each other [mm].
double radius_of(const Chain&, const Rub&);
/// Coefficient of a lumen [-], force of a valve [N].
double largest(const Chain&, const Rub&, bool holds_fast);
/// Of each rub: the normal force that its friction is proportional to, summed over the joints; 1 of a valve
/// that something is in.
std::vector<double> pressures(const Chain&, std::span<const WallContact>);
/// On the inner device, along and about the axis, with one of pressures() [N].
Vec2 force_of(const Chain&, const Rub&, double pressure);
/// Push at a device's hub by the valves that ride on it [N].
double valves_on_hub(const Chain&, int device);
/// Loads of the shafts between hands and introducer: those of the hubs without the pushes of valves on them,
/// which hands bear directly, and without those of friction on devices that no hand holds, as far as it has
/// come since slides were last followed: drag() takes it away where these go along.
std::vector<HubLoad> shaft_loads(const Chain&, std::span<const WallContact>, std::span<const HubLoad>);

}  // namespace physics
