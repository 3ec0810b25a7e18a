#pragma once
/// How the numbers of a mesh or a centreline become millimetres in the patient's frame, LPS.

#include <string>
#include <vector>

#include "physics/geometry/vec.h"

namespace anatomy {

/// What a mesh file does not say of its own numbers.
struct FileFrame {
    double scale = 1;                    // after the unit
    std::string axes = "lps";            // or ras: x to the right, y to the front
    std::vector<std::string> rotations;  // "AXIS:DEG" about the origin, in this order, right-handed
};

/// From the file's numbers, in millimetres by its unit, to the patient's frame. Throws InputError.
geometry::Mat3 to_patient(const FileFrame&);

void transform(const geometry::Mat3&, std::vector<geometry::Vec3>& points);

}  // namespace anatomy
