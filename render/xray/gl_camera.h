#pragma once
/// The C-arm as OpenGL sees it: matrices by GLM, in double precision. For source files of this room alone.

#include <glm/mat4x4.hpp>

#include "render/xray/c_arm.h"

namespace render {

/// From places about the isocentre (patient coordinates less the isocentre's [mm]) to the eye's at the focal
/// spot: it looks along −z, the head is up. Single precision keeps the digits of what is near the isocentre.
glm::dmat4 view_matrix(const CArm&);

/// From the eye's coordinates to clip coordinates, in which the detector's field is −1…1 either way and row 0
/// of the image is the lowest: what is read back from a target begins with the row next to the head. The
/// viewer faces the patient, so that right and left are exchanged. Nothing is cut off in depth: z is 0.
glm::dmat4 projection_matrix(const CArm&);

}  // namespace render
