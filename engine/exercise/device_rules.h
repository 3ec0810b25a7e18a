#pragma once
/// Which commands ask for a device that is not there, and which wires fit.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace exercise {

/// The problem with a command of a device that the scenario does not have; empty for any other.
std::string missing_device(const script::Command&, const scenario::Scenario&);

/// Where the wire that an exchange names is read from. Throws InputError for one that is not there.
std::filesystem::path file_of_wire(const std::string& name, const scenario::Scenario&);
/// A wire of the scenario's catalogue, to be used in its devices, with torsional rigidity where the
/// scenario's shafts have it. Throws InputError for an unknown device, a catheter, or a wire that is too
/// thick for the lumen.
scenario::Device wire_of_catalogue(const std::string& name, const scenario::Scenario&);

/// The commands of a script that the scenario's devices cannot follow, whatever its vessels, a sentence each.
std::vector<std::string> device_problems(const script::CommandScript&, const scenario::Scenario&);

}  // namespace exercise
