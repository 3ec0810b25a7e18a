#pragma once
/// Manipulations with a catheter: see hands_behaviours.h.

#include "engine/studies/hands_behaviours.h"

namespace studies {

BehaviourRun kick_back(Trial&);
BehaviourRun deep_seating(Trial&);
BehaviourRun wire_drag(Trial&);
BehaviourRun reformed_simmons(Trial&);

}  // namespace studies
