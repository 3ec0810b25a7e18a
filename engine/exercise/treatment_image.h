#pragma once
/// What balloons and stents are in the beam.

#include "engine/exercise/monitor.h"
#include "engine/exercise/simulation.h"

namespace exercise {

/// Adds them to a pulse that has the simulation's devices: the bands at the balloon's ends, the contrast that
/// it is filled with, and stents, crimped and deployed.
void show_treatment(const Simulation&, Pulse&);

}  // namespace exercise
