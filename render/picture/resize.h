#pragma once
/// Images at another size.

#include "render/picture/image.h"

namespace render {

/// Averages over the area of each new pixel along a side that becomes shorter, else bilinear; an image of the
/// requested size is unaltered. Throws std::invalid_argument for an empty size or image.
GrayImage resized(const GrayImage&, int width, int height);

}  // namespace render
