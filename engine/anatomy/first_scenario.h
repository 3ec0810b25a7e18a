#pragma once
/// A scenario to begin with in vessels that nobody has written one for.

#include <filesystem>
#include <string>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// TOML that `seldinger run` and `render` take as it is: a wire that passes as far as the target, so much of
/// it inside that its tip is well within the vessels, and the tip in view. `file` is the anatomy's.
std::string first_scenario(const Anatomy&, const std::filesystem::path& file);

}  // namespace anatomy
