#pragma once
/// What of the room lies in the beam besides patient and devices: table, mattress, electrodes.

#include <vector>

#include "engine/exercise/body.h"
#include "engine/scenario/scenario.h"
#include "render/xray/fluoroscope.h"

namespace exercise {

/// Closed layers in the vessels' coordinates: under the body's back a table top of carbon fibre with a
/// mattress, and on the skin of the chest electrodes with their leads, as the scenario's `[imaging]` asks
/// for. None without a body.
std::vector<render::TissueLayer> room_in_beam(const scenario::Scenario&, const Body*);

}  // namespace exercise
