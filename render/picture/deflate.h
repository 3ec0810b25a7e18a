#pragma once
/// Lossless compression of noise.

#include <cstdint>
#include <span>
#include <vector>

namespace render {

/// Appends a zlib stream (RFC 1950, 1951) of the bytes. Runs of one byte are the only repeats it looks for: a
/// noisy image after filtering has no others, and Huffman codes alone, made anew for every block, compress it
/// as well as zlib does in a tenth of the time.
void deflate_noise(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& to);

}  // namespace render
