#pragma once
/// Images at another size, and fields moved by parts of a pixel.

#include "render/picture/image.h"

namespace render {

/// Averages over the area of each new pixel along a side that becomes shorter, else bilinear; an image of the
/// requested size is unaltered. Throws std::invalid_argument for an empty size or image.
GrayImage resized(const GrayImage&, int width, int height);

/// The field moved by so many pixels to the right and down, interpolated by cubic convolution (Keys 1981,
/// a = −1/2), which keeps edges where a mean of neighbours would blur them; what moves in from outside
/// repeats the edge. A whole number of pixels changes no value. Both distances must be finite.
Field shifted(const Field&, double x, double y);

}  // namespace render
