#pragma once
/// Smoothing of fields. Outside the field the nearest value is used.

#include <functional>
#include <span>

#include "render/picture/image.h"

namespace render {

/// Convolution with a Gaussian averaged over each pixel; sigma [pixels], 0 leaves the field unchanged.
void blur(Field&, double sigma);
/// The same with a function called for each row before blurring, and for each when it is done. `after` is
/// called for a row once `before` has been called for at most `blur_reach` further rows.
using ForRow = std::function<void(int row, std::span<float> values)>;
void blur(Field&, double sigma, const ForRow& before, const ForRow& after);
/// The number of rows or columns on either side that a pixel spreads to.
int blur_reach(double sigma);
Field gaussian_blur(Field, double sigma);

/// Means over blocks of `factor` × `factor` pixels, fewer at the right and lower edge.
Field shrink(const Field&, int factor);

/// The reverse of `shrink`, bilinear between block centres.
Field enlarge(const Field&, int factor, int width, int height);

/// A square field about the same middle, of `size` pixels that are each `step` pixels of the first wide;
/// bilinear. Beyond the first field its edge is repeated.
Field stretched(const Field&, double step, int size);

}  // namespace render
