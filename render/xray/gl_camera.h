#pragma once
/// The C-arm as OpenGL sees it: matrices by GLM, in double precision. For source files of this folder only.

#include <glm/mat4x4.hpp>

#include "render/xray/c_arm.h"

namespace render {

/// From positions relative to the isocentre (patient coordinates minus the isocentre's [mm]) to those of the
/// eye at the focal spot, which looks along −z with the head up. Single precision keeps the digits of what is
/// near the isocentre.
glm::dmat4 view_matrix(const CArm&);

/// From the eye's coordinates to clip coordinates, in which the detector's field is −1…1 in either direction
/// and row 0 of the image is the lowest: pixels read back from a target begin with the row next to the head.
/// The viewer faces the patient, so right and left are exchanged. Nothing is clipped in depth: z is 0.
glm::dmat4 projection_matrix(const CArm&);

}  // namespace render
