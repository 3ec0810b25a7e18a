#pragma once
/// A scenario to begin with in vessels that nobody has written one for.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// A wire of the catalogue, which this room can't read; FirstScenario.WiresAreThoseOfTheCatalogue compares.
struct FirstWire {
    std::string_view name;
    double diameter, least_inserted;  // its shape and two segments [mm]
};
/// Widest first.
std::span<const FirstWire> first_wires();

/// TOML that `seldinger run` and `render` take as it is: a wire that passes as far as the target, so much of
/// it inside that its tip is well within the vessels, and the tip in view. `file` is the anatomy's, as the
/// scenario names it.
std::string first_scenario(const Anatomy&, const std::filesystem::path& file);

}  // namespace anatomy
