#pragma once
/// Images at another size.

#include "render/picture/image.h"

namespace render {

/// The mean over the area that each new pixel covers where a side becomes shorter, else bilinear; unaltered
/// at its own size. Throws std::invalid_argument for an empty size or image.
GrayImage resized(const GrayImage&, int width, int height);

}  // namespace render
