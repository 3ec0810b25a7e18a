#pragma once
/// Invasive pressure: what a transducer at the hub of a catheter shows (engine/blood/pressure.h).

#include <optional>

#include "engine/blood/pressure.h"
#include "engine/exercise/simulation.h"

namespace exercise {

struct TipPressure {
    double now = 0, systolic = 0, diastolic = 0, mean = 0;  // of a beat [mmHg]
};

/// At the tip of a device that has a lumen, as the vessel around the tip and its bore pass it on; empty for a
/// wire, a device that is out, one whose lumen is filled, and while something is injected through it.
std::optional<blood::Beat> beat_at_tip(const Simulation&, script::DeviceRole);
std::optional<TipPressure> pressure_at_tip(const Simulation&, script::DeviceRole);
/// The device that the transducer is at: the innermost with a lumen that is inside.
std::optional<script::DeviceRole> pressure_device(const Simulation&);
double ecg_at(const Simulation&, double time);  // [s] to [mV]
/// Where a time of the attempt is in the heart's cycle, from 0 to 1.
double heart_phase_at(const Simulation&, double time);

}  // namespace exercise
