#pragma once
/// A scenario's devices as the physics has them: nothing else of the engine makes a chain. Which commands ask
/// for a device that is not there, which wires fit, and how much contrast a catheter passes.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "physics/geometry/polyline.h"
#include "physics/wire/chain.h"
#include "physics/wire/device.h"

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

/// The problem with a command of a device that the scenario does not have; empty for any other.
std::string missing_device(const script::Command&, const scenario::Scenario&);

/// Where the device that an exchange names is read from. Throws InputError for one that is not there.
std::filesystem::path file_of_device(script::DeviceRole, const std::string& name, const scenario::Scenario&);
/// A wire or a balloon of the scenario's catalogue, to be used among its devices, with torsional rigidity
/// where the scenario's shafts have it. Throws InputError for an unknown device, one of another kind, or one
/// that does not fit the others' lumens.
scenario::Device device_of_catalogue(script::DeviceRole, const std::string& name, const scenario::Scenario&);

/// The commands of a script that the scenario's devices cannot follow, whatever its vessels, a sentence each.
std::vector<std::string> device_problems(const script::CommandScript&, const scenario::Scenario&);

/// Largest flow through a catheter at its rated pressure of 8.27 MPa (1200 psi), with a wire of this diameter
/// in `wire_inside` mm of it [ml/s]: laminar or turbulent (Blasius), whichever passes less. Contrast at body
/// temperature: 6 mPa·s, 1330 kg/m³. 0 where the wire fills the lumen.
double largest_flow(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside);
/// Saline that a pressure bag of 300 mmHg drives through it against the artery, at most 1 ml/s (estimate), as
/// a helper opens the clamp [ml/s].
double flush_flow(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside);
/// What its bore resists a slow flow of saline with, with that wire in it: 8ηL/πr⁴ of the open part, and of
/// an annulus around the wire in its middle; infinity where the wire fills the lumen [Pa·s/ml].
double bore_resistance(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside);
/// What its bore holds besides the wire [ml].
double bore_volume(const physics::DeviceSpec& catheter, double wire_diameter, double wire_inside);

}  // namespace exercise
