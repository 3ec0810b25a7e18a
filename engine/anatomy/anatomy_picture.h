#pragma once
/// A picture of an anatomy.

#include <filesystem>
#include <span>
#include <string>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// A line to be drawn over the vessels.
struct Trail {
    std::string name;
    geometry::Polyline points;  // [mm]
    std::string colour;         // "#0072b2"
    double width = 2;
};

/// Draws lumen, centrelines with the branches' names, ends, targets and trails, seen from the front, the left
/// and above, on the same scale with axes in mm, as a PNG file. Uses gnuplot. Throws InputError when the file
/// cannot be written or gnuplot is not installed; an existing file is then left unchanged.
void draw_anatomy(const Anatomy&, const std::filesystem::path& png, std::span<const Trail> = {});

}  // namespace anatomy
