#pragma once
/// A body as few bytes, to be sent to browsers: a little coarser than it was.

#include <cstddef>
#include <span>
#include <string>

#include "engine/exercise/body.h"

namespace exercise {

/// Corners of meshes are rounded to multiples of this [mm].
constexpr double body_step = 0.02;

/// Packs a body. Its meshes keep how they hang together; corners and triangles may come back in another
/// order. Blobs of texture are rounded to a fifth of the smallest radius of their layer, from 0.1 to 0.2 mm,
/// to 1.5 % of their size and 1/128 of fraction, and their axes to few degrees: fewer where they are long.
std::string packed_body(const Body&);

/// The body again, without what exposure meters need. Throws std::runtime_error for bytes that are no packed
/// body, or that of a body of more than `largest` bytes.
Body unpacked_body(std::span<const std::byte>, std::size_t largest);

}  // namespace exercise
