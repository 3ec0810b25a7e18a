#pragma once
/// Writes pictures to files and reads them back.

#include <filesystem>

#include "render/picture/image.h"

namespace run {

/// Writes a PNG that is either complete or absent: see write_whole. Throws InputError.
void write_picture(const std::filesystem::path&, const render::GrayImage&);
void write_picture(const std::filesystem::path&, const render::DeepImage&);
void write_picture(const std::filesystem::path&, const render::ColourImage&);

/// Reads a grey PNG. Throws InputError.
render::GrayImage read_picture(const std::filesystem::path&);

}  // namespace run
