#pragma once
/// Are the generator's patients those of the published populations?

#include "engine/studies/study.h"

namespace studies {

/// A hundred patients of every preset: whether all can be grown, how many draws were rejected, means and
/// spreads of their dimensions against published ones, correlations between consecutive seeds and with age
/// and height; and the surfaces of some.
StudyResult run_patients(const StudyOptions&);

}  // namespace studies
