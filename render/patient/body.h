#pragma once
/// The levels of the body: heights of vertebrae and landmarks.
///
/// Body frame: origin at the middle of the front of the fourth lumbar vertebra, +x left, +y back, +z head
/// [mm].

#include <span>
#include <string_view>

#include "physics/geometry/landmark.h"

namespace render {

/// Position of a landmark in the body frame [mm]. From the bifurcation to the valve 300, from there to the
/// sella 330: estimates for a man of 1.75 m, like all dimensions here.
geometry::Vec3 place_in_body(geometry::Landmark);

/// A vertebral body. Kyphosis and lordosis follow from the anterior faces.
struct Vertebra {
    std::string_view name;
    double z;                                    // of its middle [mm]
    double front;                                // y of its anterior face [mm]
    double half_width, half_depth, half_height;  // [mm]
};

/// From L5 up to C2.
std::span<const Vertebra> vertebrae();

/// y of the column's anterior face at a height, and its slope dy/dz.
double spine_front(double z);
double spine_slope(double z);

}  // namespace render
