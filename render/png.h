#pragma once
/// Grey images in PNG files.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "render/image.h"

namespace render {

/// The bytes of a PNG file: 8-bit grey, no time stamp, so that equal images give equal bytes. Noise does not
/// compress: a low level and the Sub filter are nearly as small as the best, and much faster.
/// Throws std::invalid_argument for an image without pixels or of the wrong length.
std::vector<std::uint8_t> encode_png(const GrayImage&);

/// Writes beside the target, as path + ".part", then renames: a reader never meets half a file. On any
/// failure nothing is left behind and std::runtime_error names the path and the reason the system gave.
void write_png(const std::filesystem::path&, const GrayImage&);

/// Reads an 8-bit grey PNG. Throws std::runtime_error naming the path when it cannot be read or is of another
/// kind.
GrayImage read_png(const std::filesystem::path&);

}  // namespace render
