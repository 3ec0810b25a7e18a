#pragma once
/// Contacts that no wire can have: where they appear, a motion has led out of the vessels.

#include <algorithm>

#include "physics/wall/wall.h"

namespace physics {

/// Whether a joint is deeper in its wall than the lumen is wide, however much of it the joint fills, has
/// pushed its vessel aside by more than five of its radii and 10 mm, or is outside where no wall is in reach.
inline bool astray(const WallContact& c) {
    constexpr double farthest = 10, radii = 5;  // [mm], [-]
    constexpr double in_no_ball = -2e-3;        // penetration of a joint that is in no inscribed ball [mm]
    if (!(c.clearance > 0)) return false;
    if (c.touches())
        return c.pressed_in() > c.clearance + c.thickness ||
               c.given.norm() > std::max(farthest, radii * c.clearance);
    return c.normal.isZero(0) && c.penetration > in_no_ball;
}

}  // namespace physics
