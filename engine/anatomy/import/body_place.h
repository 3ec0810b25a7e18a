#pragma once
/// Where in the body an imported lumen lies.

#include <optional>
#include <string>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// pelvis and abdomen hang on the aortic bifurcation, chest on the aortic valve, head on the sella. Throws
/// InputError for another word.
geometry::Landmark landmark_of_part(const std::string& part);

/// Sets the anatomy's body: its landmark lies where the user says or, without that, where such vessels
/// usually have it. Returns what was assumed, a sentence for the report.
std::string place_in_part(Anatomy&, const std::string& part, const std::optional<geometry::Vec3>& landmark);

}  // namespace anatomy
