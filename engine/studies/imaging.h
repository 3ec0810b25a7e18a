#pragma once
/// The parts of the study of images, each with its tables, pictures and the text that goes with them.

#include "engine/studies/study.h"

namespace studies {

constexpr double imaging_kvp = 74;  // for figures that are given for one voltage only

StudyResult imaging_lengths(const StudyOptions&);  // path lengths: closed forms, ray tracer, balance
StudyResult imaging_wire(const StudyOptions&);     // the wire's shadow: supersampled rays
StudyResult imaging_bins(const StudyOptions&);     // energies: the full spectrum
StudyResult imaging_noise(const StudyOptions&);    // noise: its variance and power spectrum
StudyResult imaging_times(const StudyOptions&);    // what each stage costs

}  // namespace studies
