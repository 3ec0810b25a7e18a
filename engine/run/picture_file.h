#pragma once
/// Pictures into files.

#include <filesystem>

#include "render/picture/image.h"

namespace run {

/// A PNG that is whole or not there: see write_whole. Throws InputError.
void write_picture(const std::filesystem::path&, const render::GrayImage&);
void write_picture(const std::filesystem::path&, const render::ColourImage&);

}  // namespace run
