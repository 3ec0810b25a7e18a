#pragma once
/// What of a scenario the beam meets.

#include <vector>

#include "engine/monitor.h"
#include "engine/scenario.h"
#include "engine/simulation.h"
#include "render/fluoroscope.h"

namespace engine {

/// The lumen, closed at its ends, takes the contrast; around it a patient or air. Throws InputError for a
/// lumen that capping does not close.
std::vector<render::TissueLayer> tissue_layers(const Scenario&, const Anatomy&);

/// What the console asks for and the beam meets, after the last step.
Pulse pulse_of(const Simulation&);
bool has_contrast(const render::Exposure&);
void remove_contrast(render::Exposure&);

/// A fluoroscope for the scenario, whose contrast has the nodes of the simulation's. Throws InputError when
/// it cannot be made.
render::Fluoroscope make_fluoroscope(const Simulation&);

}  // namespace engine
