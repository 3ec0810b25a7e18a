#pragma once
/// Writes pictures to files and reads them back; numbers per pixel as images of 16 bits.

#include <filesystem>

#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace run {

/// Writes a PNG that is either complete or absent: see write_whole. Throws InputError.
void write_picture(const std::filesystem::path&, const render::GrayImage&);
void write_picture(const std::filesystem::path&, const render::DeepImage&);
void write_picture(const std::filesystem::path&, const render::ColourImage&);

/// Reads a grey PNG. Throws InputError.
render::GrayImage read_picture(const std::filesystem::path&);

/// Quanta that a level of a stored signal stands for, where the detector's pulse has `dose` [nGy]: that dose
/// is level 4096, a sixteenth of the range, for lung and direct radiation lie above.
double quanta_per_level(const render::CArm&, double dose);

/// Each value over `per_level`, to the nearest level; what is below 0 or no number is 0, what exceeds 65535
/// is cut off.
render::DeepImage deep_picture(const render::Field&, double per_level);

}  // namespace run
