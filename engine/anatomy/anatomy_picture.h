#pragma once
/// An anatomy to look at.

#include <filesystem>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// Lumen, centrelines with the branches' names, ends and targets, from the front, the left and above, on the
/// same scale with axes in mm, as a PNG file. Drawn by gnuplot. Throws InputError when the file cannot be
/// written or gnuplot is not installed; the file then is what it was.
void draw_anatomy(const Anatomy&, const std::filesystem::path& png);

}  // namespace anatomy
