#pragma once
/// From the mean over each voxel to samples between which materials are interpolated.

#include "engine/patient/ct_image.h"

namespace patient {

/// A scanner's number is a mean over a voxel. Straight lines between such numbers would blur a second time,
/// over two more voxels. This replaces them with those samples whose linear interpolation has the given
/// numbers as its means: along each axis (s[i−1] + 6 s[i] + s[i+1])/8 = mean[i], with s constant beyond the
/// ends. Sums along rays are kept; at an edge samples go up to a fifth of the step beyond it on each axis.
void interpolate_means(CtImage&);

}  // namespace patient
