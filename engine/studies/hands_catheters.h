#pragma once
/// Manipulations with a catheter: see hands_behaviours.h.

#include "engine/studies/hands_behaviours.h"

namespace studies {

BehaviourRun kick_back(const StudyOptions&);
BehaviourRun deep_seating(const StudyOptions&);
BehaviourRun wire_drag(const StudyOptions&);
BehaviourRun reformed_simmons(const StudyOptions&);

}  // namespace studies
