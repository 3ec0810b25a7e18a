#pragma once
/// The map of what breaks which method: every way of breaking one against every method.

#include "engine/studies/study.h"

namespace studies {

StudyResult run_stability(const StudyOptions&);

}  // namespace studies
