#pragma once
/// Images in PNG files.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "render/image.h"

namespace render {

/// The bytes of a PNG file: 8 bits a channel, no time stamp, so that equal images give equal bytes. Noise
/// does not compress: a low level and the Sub filter are nearly as small as the best, and much faster. Throws
/// std::invalid_argument for an image without pixels or of the wrong length.
std::vector<std::uint8_t> encode_png(const GrayImage&);
std::vector<std::uint8_t> encode_png(const ColourImage&);

/// Writes beside the target, as path + ".part", then renames: a reader never meets half a file. On any
/// failure nothing is left behind and std::runtime_error names the path and the reason the system gave.
void write_png(const std::filesystem::path&, const GrayImage&);
void write_png(const std::filesystem::path&, const ColourImage&);

/// Reads an 8-bit PNG, grey or red, green and blue, without transparency. Throws std::runtime_error naming
/// the path when it cannot be read or is of another kind.
GrayImage read_png(const std::filesystem::path&);
ColourImage read_colour_png(const std::filesystem::path&);

}  // namespace render
