#pragma once
/// What choosing λ by the anatomy and coarsening the wire where it is straight save, and what they cost in
/// accuracy.

#include "engine/studies/study.h"

namespace studies {

StudyResult run_economy(const StudyOptions&);

}  // namespace studies
