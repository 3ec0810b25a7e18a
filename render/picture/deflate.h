#pragma once
/// Lossless packing of noise.

#include <cstdint>
#include <span>
#include <vector>

namespace render {

/// Appends a zlib stream (RFC 1950, 1951) of the bytes. It looks for no repeats but runs of one byte: in what
/// a filter leaves of a noisy image there are none, and Huffman codes alone, made anew for every block, pack
/// it as well as zlib does in a tenth of the time.
void deflate_noise(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& to);

}  // namespace render
