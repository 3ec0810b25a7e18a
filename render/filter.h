#pragma once
/// Smoothing of fields. Outside the field the nearest value is taken.

#include "render/image.h"

namespace render {

/// Convolution with a Gaussian averaged over each pixel; sigma [pixels], nothing happens at 0.
void blur(Field&, double sigma);
Field gaussian_blur(Field, double sigma);

/// Means over blocks of `factor` × `factor` pixels, fewer at the right and lower edge.
Field shrink(const Field&, int factor);

/// The reverse of `shrink`, bilinear between block centres.
Field enlarge(const Field&, int factor, int width, int height);

}  // namespace render
