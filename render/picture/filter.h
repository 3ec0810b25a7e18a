#pragma once
/// Smoothing of fields. Outside the field the nearest value is taken.

#include <functional>
#include <span>

#include "render/picture/image.h"

namespace render {

/// Convolution with a Gaussian averaged over each pixel; sigma [pixels], nothing happens at 0.
void blur(Field&, double sigma);
/// The same with something done to each row before, and to each when it is done. A row's `after` comes when
/// `before` has had at most `blur_reach` rows more.
using ForRow = std::function<void(int row, std::span<float> values)>;
void blur(Field&, double sigma, const ForRow& before, const ForRow& after);
/// Rows or columns to either side that a pixel spreads to.
int blur_reach(double sigma);
Field gaussian_blur(Field, double sigma);

/// Means over blocks of `factor` × `factor` pixels, fewer at the right and lower edge.
Field shrink(const Field&, int factor);

/// The reverse of `shrink`, bilinear between block centres.
Field enlarge(const Field&, int factor, int width, int height);

}  // namespace render
