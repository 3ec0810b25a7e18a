#pragma once
/// Are generated vessels fit to push wires through?

#include "engine/studies/study.h"

namespace engine {

/// Every preset: time, triangles, angles, distance from the implicit surface, topology.
StudyResult run_anatomy(const StudyOptions&);

}  // namespace engine
