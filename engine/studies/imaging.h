#pragma once
/// Whether frames are what physics says, and what they cost.

#include "engine/studies/study.h"

namespace studies {

constexpr double imaging_kvp = 74;  // where a figure is given for one voltage only

StudyResult run_imaging(const StudyOptions&);

/// Its parts, each with its tables, pictures and the text that goes with them.
StudyResult imaging_lengths(const StudyOptions&);  // path lengths: closed forms, ray tracer, balance
StudyResult imaging_wire(const StudyOptions&);     // its shadow: supersampled rays
StudyResult imaging_bins(const StudyOptions&);     // energies: the full spectrum
StudyResult imaging_noise(const StudyOptions&);    // its variance and power spectrum
StudyResult imaging_times(const StudyOptions&);    // what each stage costs

}  // namespace studies
