#pragma once
/// What of a scenario the beam meets.

#include <span>
#include <vector>

#include "engine/monitor.h"
#include "engine/scenario.h"
#include "engine/simulation.h"
#include "render/fluoroscope.h"

namespace engine {

/// The lumen, closed at its ends, takes the contrast; around it a patient or air. Throws InputError for a
/// lumen that capping does not close.
std::vector<render::TissueLayer> tissue_layers(const Scenario&, const Anatomy&);

/// An organ that is drawn and that contrast reaches.
struct BlushingOrgan {
    int layer = 0;             // of the fluoroscope
    double volume = 0;         // [ml]
    std::vector<int> outlets;  // of the blood, that feed it
};

/// For each outlet the nearest layer that its organ's name ends with ("kidney", "left kidney").
std::vector<BlushingOrgan> blushing_organs(const std::vector<render::TissueLayer>&, std::span<const Outlet>);

struct ImagingChain {
    render::Fluoroscope fluoroscope;
    std::vector<BlushingOrgan> organs;
};

/// A fluoroscope for the scenario, with the nodes of that contrast. Throws InputError when
/// it cannot be made.
ImagingChain make_imaging(const Scenario&, const Anatomy&, const ContrastFlow&);

/// Of a pulse in that mode [nGy]. A field magnified against that of the start gets more in proportion, so
/// that what is seen larger is not seen noisier.
double detector_dose(const Scenario&, const render::CArm&, ImagingMode);

/// What the console asks for and the beam meets, after the last step.
Pulse pulse_of(const Simulation&, std::span<const BlushingOrgan>);
bool has_contrast(const render::Exposure&);
void remove_contrast(render::Exposure&);

}  // namespace engine
