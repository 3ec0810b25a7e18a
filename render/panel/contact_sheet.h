#pragma once
/// Many frames on one page.

#include <span>
#include <string>

#include "render/picture/image.h"

namespace render {

/// Tiles in rows of `columns`, each `tile_width` wide and as high as the tallest image needs at that width, 4
/// pixels apart, row by row from the upper left. Labels stand in the upper left corner of their tile, cut to
/// its width; there may be fewer labels than images. Throws std::invalid_argument for no images, an empty
/// image, or columns or tile_width below 1, and std::runtime_error when there are labels and GL fails.
GrayImage contact_sheet(std::span<const GrayImage> images, int columns, int tile_width,
                        std::span<const std::string> labels = {});

}  // namespace render
