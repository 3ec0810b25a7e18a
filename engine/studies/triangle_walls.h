#pragma once
/// Relaxation on walls of triangles, as the paper's are.

#include "engine/studies/study.h"

namespace studies {

StudyResult run_triangle_walls(const StudyOptions&);

}  // namespace studies
