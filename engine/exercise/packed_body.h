#pragma once
/// A body as few bytes, to be sent to browsers.

#include <cstddef>
#include <span>
#include <string>

#include "engine/exercise/body.h"

namespace exercise {

/// Packs a body. One that rounded_body() made comes back bit for bit.
std::string packed_body(const Body&);

/// The body again, without what exposure meters need. Throws std::runtime_error for bytes that are no packed
/// body, or that of a body of more than `largest` bytes.
Body unpacked_body(std::span<const std::byte>, std::size_t largest);

/// The body as packing leaves it, so that there is one everywhere. Corners are multiples of
/// render::corner_step, corners and triangles in the order of geometry::ordered(). Blobs that no pattern
/// draws are in the order of their places; these are rounded to half the smallest radius of their layer, from
/// 0.1 to 0.4 mm, sizes to 3 %, fractions to 1/128, and axes to a few degrees: fewer where they are long.
Body rounded_body(const Body&);

}  // namespace exercise
