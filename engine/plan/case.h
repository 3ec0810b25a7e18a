#pragma once
/// What is planned: vessels, an entry, a target, and the devices to try.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/scenario/scenario.h"

namespace plan {

/// Devices to be tried together, innermost first.
struct Candidate {
    std::string name;  // "glide035+cobra5f"; empty = those that the scenario has
    std::vector<std::pair<script::DeviceRole, std::string>> devices = {};
};

/// "glide035,jwire035,glide035+cobra5f": devices of the catalogue, or files; those tried together are joined
/// by +, a wire first, then from the innermost catheter outward. "wires" stands for every wire of the
/// catalogue as thick as the scenario's, within 0.1 mm, "own" for the scenario's devices. Throws InputError
/// for unknown names, a first device that is no wire, others that are none that go over it, and doubles.
std::vector<Candidate> candidates_of(const std::string& list, const scenario::Scenario&,
                                     const std::filesystem::path& catalogue);

/// "rosen035,amplatzS035": wires of the catalogue, or files; "wires" as above. Throws InputError for unknown
/// names, and for devices that are no wires.
std::vector<std::string> wires_of(const std::string& list, const scenario::Scenario&,
                                  const std::filesystem::path& catalogue);

/// A scenario as TOML, and the file that it is from or would be: what it names lies beside that.
struct CaseText {
    std::string toml;
    std::filesystem::path file;
};

/// The scenario of a file; of vessels (NAME.anatomy.json), one with a wire at the first end and the target at
/// the first that they have. Throws InputError.
CaseText case_of(const std::filesystem::path& scenario_or_anatomy, const std::string& wire);

/// Of another patient of the scenario, "2" or "seed:17" (scenario::load_scenario); empty or "1" is the first.
/// Throws InputError.
CaseText with_patient(const CaseText&, const std::string& patient, const std::filesystem::path& catalogue);

/// With another target, empty = as it is: the name of one, a branch, a branch and the way along it from its
/// origin as "LRA:20", or a place as "12.5,-3,40" [mm]; and with another entry, the name of an end. A branch
/// alone is its middle. Throws InputError that says what there is.
CaseText with_ends(const CaseText&, const std::string& to, const std::string& from,
                   const std::filesystem::path& catalogue, const anatomy::ModelCache&);

/// With these devices. A wire keeps the length that is inside at the start. A device around it keeps its own
/// where the scenario has one in that place, and else starts outside.
CaseText with_devices(const CaseText&, const Candidate&);

/// The same where it is put into another folder: files beside it are named by their whole path.
CaseText moved_to(const CaseText&, const std::filesystem::path& file);

}  // namespace plan
