#pragma once
/// What the vessels of an anatomy lie in: how far they make way for a device.

#include <span>
#include <string_view>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "physics/wall/foundation.h"

namespace anatomy {

/// A kind of vessel, by where it is in the body and how wide it is.
struct TissueKind {
    std::string_view vessels;
    double support;     // force of the tissue per area of vessel and way [N/mm³]
    double wave_speed;  // of the pulse [m/s]
    std::string_view source;

    /// Of a vessel of this radius [mm]: k_f = 2πR · support, as the tissue holds it all round, and
    /// E h/R = 2 ρ c² with ρ = 1060 kg/m³ (Moens and Korteweg).
    physics::Tissue tissue(double radius) const;
};

/// Every kind that tissues_of() tells apart.
std::span<const TissueKind> tissue_kinds();

/// One a branch. Where the body is not known, the head's vessels are those of the limbs and the trunk.
std::vector<physics::Tissue> tissues_of(const Anatomy&);

}  // namespace anatomy
