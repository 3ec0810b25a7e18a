#pragma once
/// The random walls of the paper's Monte Carlo simulation (Section 3.5).

#include <cstdint>

#include "physics/wall/wall_stiffness.h"

namespace studies {

inline constexpr int profile_terms = 9;  // G of Eq. 41

/// Eq. 41 over `length` [mm] with k_g uniform in [0, 2^−g k] and φ_g in [0, 2π), determined by seed and
/// number of the realisation alone, the same on every machine. k in N/mm.
physics::WallStiffness random_profile(double k, double length, std::uint64_t seed, int realisation);

}  // namespace studies
