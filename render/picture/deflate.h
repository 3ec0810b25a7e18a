#pragma once
/// Lossless compression of noise.

#include <cstdint>
#include <span>
#include <vector>

namespace render {

/// Appends a zlib stream (RFC 1950, 1951) of the bytes. Runs of one byte are the only repeats it looks for: a
/// noisy image after filtering has no others, and Huffman codes alone, made anew for every block, compress it
/// as well as zlib does in a tenth of the time. `triples`: three equal bytes often follow one another, as in
/// grey parts of a coloured image; they are then written at once, to the same stream.
void deflate_noise(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& to, bool triples = false);

}  // namespace render
