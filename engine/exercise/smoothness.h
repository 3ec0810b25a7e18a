#pragma once
/// How smoothly a tip moves, from its speed frame by frame.

#include <optional>
#include <span>

namespace exercise {

/// Spectral arc length (Balasubramanian 2012): −∫ of the arc of the speed's normalised spectrum up to 10 Hz,
/// or to half the rate where that is less, from the first to the last frequency with at least 5 % of the
/// greatest; the speed is padded by zeros to 16 times its length or more. Near −1.4 for one smooth stroke,
/// the lower the more the speed changes. Empty for fewer than two frames, for a tip that never moves, and for
/// more than 2^18 frames. `speed` [mm/s], `rate` of its frames [1/s].
std::optional<double> spectral_arc_length(std::span<const double> speed, double rate);

/// Log dimensionless jerk (Balasubramanian 2015): −ln(T³/v_max² · Σ (d²v/dt²)² Δt), differences of second
/// order. The lower the less smooth. Empty for fewer than three frames or a speed without a second
/// derivative.
std::optional<double> log_dimensionless_jerk(std::span<const double> speed, double rate);

}  // namespace exercise
