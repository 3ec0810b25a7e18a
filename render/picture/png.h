#pragma once
/// Images in PNG files.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "render/picture/image.h"

namespace render {

/// The bytes of a PNG file: 8 bits per channel, 16 for deep images, no time stamp, so that equal images give
/// equal bytes. Grey images are taken to be noise and compressed as such, coloured ones to be panels, where
/// text and lines repeat. Throws std::invalid_argument for an image without pixels or of the wrong length.
std::vector<std::uint8_t> encode_png(const GrayImage&);
std::vector<std::uint8_t> encode_png(const DeepImage&);
std::vector<std::uint8_t> encode_png(const ColourImage&);

/// Reads a PNG, grey of 8 bits, grey of 16 bits or RGB of 8 bits, without transparency. Throws
/// std::runtime_error naming the path when it cannot be read or is of another kind.
GrayImage read_png(const std::filesystem::path&);
DeepImage read_deep_png(const std::filesystem::path&);
ColourImage read_colour_png(const std::filesystem::path&);

}  // namespace render
