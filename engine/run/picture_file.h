#pragma once
/// Pictures into files and back.

#include <filesystem>

#include "render/picture/image.h"

namespace run {

/// A PNG that is whole or not there: see write_whole. Throws InputError.
void write_picture(const std::filesystem::path&, const render::GrayImage&);
void write_picture(const std::filesystem::path&, const render::ColourImage&);

/// A grey PNG. Throws InputError.
render::GrayImage read_picture(const std::filesystem::path&);

}  // namespace run
