#pragma once
/// What is in the way of blood in a branch.

#include "physics/geometry/vec.h"

namespace blood {

struct Obstruction {
    int branch = 0;                                                                 // of the anatomy
    geometry::Vec3 from = geometry::Vec3::Zero(), middle = geometry::Vec3::Zero();  // on its centreline [mm]
    /// Pressure that it takes of a flow Q [ml/s]: laminar · Q + turbulent · Q² [Pa s/ml], [Pa s²/ml²].
    double laminar = 0, turbulent = 0;
    double passes = 1;  // fraction of the flow that a plug lets by; 0 = none, and nothing gets beyond it [-]
};

}  // namespace blood
