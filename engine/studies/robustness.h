#pragma once
/// Can anything a hand may do break the wire? Random tubes, and wild hands in anatomies.

#include "engine/studies/study.h"

namespace studies {

/// 20 000 pushes of one segment through random tubes, and 12 000 frames of wild hands in the scenarios of
/// options.scenarios and in the meshes of options.real_meshes, where these exist; quick: 300 and 150. The
/// same on any number of threads, times aside.
StudyResult run_robustness(const StudyOptions&);

}  // namespace studies
