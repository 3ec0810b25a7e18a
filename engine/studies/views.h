#pragma once
/// The patient of each region from several sides, as fluoroscopy shows it.

#include "engine/studies/study.h"

namespace studies {

StudyResult run_views(const StudyOptions&);

}  // namespace studies
