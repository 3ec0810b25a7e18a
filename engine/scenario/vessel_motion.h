#pragma once
/// Heartbeat and breathing: where the vessels are at a time.

#include "physics/geometry/vec.h"

namespace scenario {

/// Vessels, introducer and wire move together, without turning or changing shape, so that the wire's
/// equilibrium is the same in their frame; bones and skin stand still. Off at zero amplitude.
struct VesselMotion {
    double heart_rate = 70;                                   // [1/min]
    geometry::Vec3 heart_reach = geometry::Vec3::Zero();      // at the end of systole [mm]
    double breathing_rate = 15;                               // [1/min]
    geometry::Vec3 breathing_reach = geometry::Vec3::Zero();  // at the end of inspiration [mm]

    bool moves() const { return !heart_reach.isZero() || !breathing_reach.isZero(); }
    /// Displacement from diastole at the end of expiration, the state at time 0 [mm]. `time` [s].
    geometry::Vec3 at(double time) const;
};

/// 0 at the end of diastole, 1 at the end of systole; `time` [s], `rate` [1/min]. Systole takes a third of
/// the beat and the return the rest, each half a cosine.
double contraction(double time, double rate);

/// 0 at the end of expiration, 1 at the end of inspiration: sin⁴ of half the phase, which rests in expiration
/// (Lujan et al. 1999, with n = 2). `time` [s], `rate` [1/min].
double inspiration(double time, double rate);

}  // namespace scenario
