#pragma once
/// The values of distance fields as few bytes, to be sent to browsers.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "physics/wall/field_sampler.h"

namespace physics {

/// Packs grids of values that are multiples of `value_step`, not fitted, with their bricks. Each value is
/// predicted from those before it, in its brick and in the bricks below, and from how far these were off;
/// where an earlier sheet or the next finer grid has the same node, its value is tried first.
std::string packed_values(const std::vector<SheetField>&);

/// The grids again, bit for bit. Throws std::runtime_error for bytes that packed_values has not written, or
/// values of more than `largest` bytes.
std::vector<SheetField> unpacked_values(std::span<const std::byte>, double spacing, std::size_t sheets,
                                        std::size_t largest);

}  // namespace physics
