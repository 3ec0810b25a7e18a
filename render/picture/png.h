#pragma once
/// Images in PNG files.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "render/picture/image.h"

namespace render {

/// The bytes of a PNG file: 8 bits a channel, no time stamp, so that equal images give equal bytes. Grey
/// images are taken for noise, which is packed as such, coloured ones for panels, where text and lines
/// repeat. Throws std::invalid_argument for an image without pixels or of the wrong length.
std::vector<std::uint8_t> encode_png(const GrayImage&);
std::vector<std::uint8_t> encode_png(const ColourImage&);

/// Reads an 8-bit PNG, grey or red, green and blue, without transparency. Throws std::runtime_error naming
/// the path when it cannot be read or is of another kind.
GrayImage read_png(const std::filesystem::path&);
ColourImage read_colour_png(const std::filesystem::path&);

}  // namespace render
