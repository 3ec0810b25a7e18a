#pragma once
/// A picture of an anatomy.

#include <filesystem>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// Draws lumen, centrelines with the branches' names, ends and targets, seen from the front, the left and
/// above, on the same scale with axes in mm, as a PNG file. Uses gnuplot. Throws InputError when the file
/// cannot be written or gnuplot is not installed; an existing file is then left unchanged.
void draw_anatomy(const Anatomy&, const std::filesystem::path& png);

}  // namespace anatomy
