#pragma once
/// Landmarks of the body, by which vessels are put into a patient.

#include <optional>
#include <span>
#include <string_view>

#include "physics/geometry/vec.h"

namespace geometry {

enum class Landmark { AorticBifurcation, AorticValve, Sella };

/// A landmark of the body and where vessels put it.
struct BodyPlace {
    Landmark landmark = Landmark::AorticBifurcation;
    Vec3 at = Vec3::Zero();  // in the frame of the vessels [mm]
};

/// "aortic bifurcation", "aortic valve", "sella".
std::string_view name_of(Landmark);
std::optional<Landmark> landmark_named(std::string_view);
std::span<const std::string_view> landmark_names();

}  // namespace geometry
