#pragma once
/// Which commands ask for a catheter, and which wires fit it.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace exercise {

/// Whether a command is of the catheter, or of both devices.
bool needs_catheter(const script::Command&);
/// The problem with such a command in a scenario without one, for messages.
std::string no_catheter(const script::Command&);

/// Where the wire that an exchange names is read from. Throws InputError for one that is not there.
std::filesystem::path file_of_wire(const std::string& name, const scenario::Scenario&);
/// A wire of the scenario's catalogue, to be used in its catheter. Throws InputError for an unknown device, a
/// catheter, or a wire that is too thick for the lumen.
scenario::Device wire_of_catalogue(const std::string& name, const scenario::Scenario&);

/// The commands of a script that the scenario's devices cannot follow, whatever its vessels, a sentence each.
std::vector<std::string> device_problems(const script::CommandScript&, const scenario::Scenario&);

}  // namespace exercise
