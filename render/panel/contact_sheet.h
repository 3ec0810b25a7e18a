#pragma once
/// Many frames on one page.

#include <span>
#include <string>
#include <string_view>

#include "render/picture/image.h"

namespace render {

/// Tiles in rows of `columns`, each `tile_width` wide and as high as the tallest image needs at that width, 4
/// pixels apart, row by row from the upper left. Images are reduced by the mean over each tile pixel's area.
/// Labels stand in the upper left corner of their tile; fewer labels than images are allowed. Throws
/// std::invalid_argument for no images, an empty image, or columns or tile_width below 1.
GrayImage contact_sheet(std::span<const GrayImage> images, int columns, int tile_width,
                        std::span<const std::string> labels = {});

/// Mean over the area that each new pixel covers. Throws std::invalid_argument for an empty size or image.
GrayImage resample(const GrayImage&, int width, int height);

/// Writes in a 5 × 7 face, upper left corner of the first letter at (x, y); parts outside are left out.
/// Digits, letters (shown as capitals), space . : - + / and %; anything else shows as a box.
void draw_text(GrayImage&, int x, int y, std::string_view text, std::uint8_t grey);

constexpr int letter_width = 6;   // with the gap [pixels]
constexpr int letter_height = 7;  // [pixels]

}  // namespace render
