#pragma once
/// What the vessels of an anatomy lie in: how far they make way for a device.

#include <vector>

#include "engine/anatomy/anatomy.h"
#include "physics/wall/foundation.h"

namespace anatomy {

/// One a branch. Where the body is not known, the head's vessels are those of the limbs and the trunk.
std::vector<physics::Tissue> tissues_of(const Anatomy&);

}  // namespace anatomy
