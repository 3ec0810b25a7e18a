#pragma once
/// How far a chain of segments is from the exact wire: by the length of its segments, by what its first and
/// last joint stand for, and by the processor time of a method.

#include "engine/studies/study.h"

namespace studies {

StudyResult run_accuracy(const StudyOptions&);

}  // namespace studies
