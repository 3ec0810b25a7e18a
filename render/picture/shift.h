#pragma once
/// Moves a field by parts of a pixel.

#include "render/picture/image.h"

namespace render {

/// The field moved by so many pixels to the right and down, interpolated by cubic convolution (Keys 1981,
/// a = −1/2), which keeps edges where a mean of neighbours would blur them; what moves in from outside
/// repeats the edge. A whole number of pixels changes no value. Both distances must be finite.
Field shifted(const Field&, double x, double y);

}  // namespace render
