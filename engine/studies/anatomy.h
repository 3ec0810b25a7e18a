#pragma once
/// Are generated vessels fit to push wires through?

#include "engine/studies/study.h"

namespace studies {

/// Every preset: time, triangles, angles, distance from the implicit surface, topology; and imported again
/// from its mesh, clean and corrupted: time, branches, ends, distance from the true centrelines, radii.
/// Meshes from elsewhere where options.real_meshes has them. Of two presets, how well the walls of a
/// simulation distinguish inside from outside.
StudyResult run_anatomy(const StudyOptions&);

}  // namespace studies
