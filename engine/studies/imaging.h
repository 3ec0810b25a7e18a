#pragma once
/// Whether frames are what physics says, and what they cost.

#include "engine/studies/study.h"

namespace engine {

StudyResult run_imaging(const StudyOptions&);

/// Its parts, each with its tables, pictures and the text that goes with them.
StudyResult imaging_lengths(const StudyOptions&);  // path lengths: closed forms, ray tracer, balance
StudyResult imaging_signal(const StudyOptions&);   // wire, energy bins, noise
StudyResult imaging_times(const StudyOptions&);    // what each stage costs

}  // namespace engine
