#pragma once
/// Are generated vessels fit to push wires through?

#include "engine/studies/study.h"

namespace studies {

/// For every preset: time, triangles, angles, distance from the implicit surface, topology; and the same
/// re-imported from its mesh, clean and corrupted: time, branches, ends, distance from the true centrelines,
/// radii. Includes meshes from elsewhere where options.real_meshes has them. For two presets, also how well
/// the walls of a simulation distinguish inside from outside.
StudyResult run_anatomy(const StudyOptions&);

}  // namespace studies
